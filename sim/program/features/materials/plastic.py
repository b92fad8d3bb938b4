"""Metal-like plasticity: von Mises, linear isotropic hardening [Simo 1992]."""

from typing import Literal

from mpmworlds.sim.program.features.deformation import F, parts
from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.fields import particle
from mpmworlds.sim.program.words import (
    DT,
    C,
    hook,
    mat2,
    stress,
    ti,
)
from mpmworlds.sim.scene.fields import about

slip = particle("float", "0.0", "plastic shear strain so far")


class Plastic(Solid):
    """Elastic up to a yield stress, which hardening raises; then it deforms for good.

    The yield stress is that in shear: a bar yields at sqrt(3) of it.
    """

    FAMILY = "elastic/plastic"
    TEARS_AT = 5.0

    constitutive_model: Literal["plastic"] = about("material", "constitutive model")
    yield_stress: float = about(
        "material",
        "shear stress at which it yields",
        "Pa",
        ge=1.0,
        le=1e8,
        kind="strength",
    )
    hardening_modulus: float = about(
        "material",
        "rise per plastic shear strain",
        "Pa",
        default=0.0,
        ge=0.0,
        le=1e8,
        kind="strength",
    )

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress, with hardening if there is any."""
        numbers = self.moduli() | {"k": self.yield_stress}
        if self.hardening_modulus == 0.0:
            return {"deform": numbers}
        return {"harden": numbers | {"slope": self.hardening_modulus}}


@ti.func
def plastic(F, E, nu, k, slope):
    """Von Mises [Simo 1992]: F, new slip, Kirchhoff stress whose shear is at most k."""
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, r, R, D = parts(F)
    slip = ti.max(2.0 * mu * r - k, 0.0) / (mu + slope)
    r -= 0.5 * slip
    mean = 0.5 * (mu + lam) * (J - 1.0 / J)
    tau = mean * mat2(1.0, 0.0, 0.0, 1.0) + 2.0 * mu * r * D @ R.transpose()
    return ti.sqrt(J / (1.0 - r * r)) * (R + r * D), slip, tau


@hook.stress
def deform(p, E, nu, k):
    F[p] += DT * C[p] @ F[p]
    F[p], _, stress[p] = plastic(F[p], E, nu, k, 0.0)


@hook.stress
def harden(p, E, nu, k, slope):
    F[p] += DT * C[p] @ F[p]
    F[p], more, stress[p] = plastic(F[p], E, nu, k + slope * slip[p], slope)
    slip[p] += more
