"""Elastic bodies: fixed corotated, with Kelvin-Voigt damping."""

from typing import Literal

from mpmworlds.sim.program.features.deformation import F
from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.words import (
    DT,
    C,
    hook,
    mat2,
    stress,
    ti,
)
from mpmworlds.sim.scene.fields import about


class Elastic(Solid):
    """Fixed corotated elasticity with Kelvin-Voigt damping."""

    FAMILY = "elastic/plastic"
    TEARS_AT = 5.0

    constitutive_model: Literal["elastic"] = about("material", "constitutive model")
    damping: float = about(
        "material",
        "Kelvin-Voigt viscosity",
        "Pa s",
        default=0.0,
        ge=0.0,
        le=1e4,
        kind="viscosity",
    )

    def kinematic_viscosity(self) -> float:
        """That of the damping: eta / rho."""
        return self.damping / self.density

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress, and damping if there is any."""
        damped = {"damp": {"eta": self.damping}} if self.damping else {}
        return {"deform": self.moduli()} | damped


@ti.func
def corotated(F, E, nu):
    """Kirchhoff stress 2 mu (F - R) F^T + lam J (J - 1) I [Stomakhin et al. 2012]."""
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, c, s = F.determinant(), F[0, 0] + F[1, 1], F[1, 0] - F[0, 1]
    R = mat2(c, -s, s, c) / ti.max(ti.sqrt(c * c + s * s), 1e-9)  # of F = R S
    I = mat2(1.0, 0.0, 0.0, 1.0)
    return 2.0 * mu * (F - R) @ F.transpose() + lam * J * (J - 1.0) * I


@hook.stress
def deform(p, E, nu):
    F[p] += DT * C[p] @ F[p]
    stress[p] = corotated(F[p], E, nu)


@hook.stress
def damp(p, eta):
    stress[p] += eta * (C[p] + C[p].transpose())
