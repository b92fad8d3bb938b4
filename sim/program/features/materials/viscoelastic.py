"""Maxwell fluids: Hencky strain whose shear decays [Fang et al. 2019]."""

from typing import Literal

from mpmworlds.sim.program.features.deformation import F, parts
from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.features.materials.sand import loose
from mpmworlds.sim.program.words import (
    DT,
    C,
    hook,
    mat2,
    stress,
    ti,
)
from mpmworlds.sim.scene.fields import about


class Viscoelastic(Solid):
    """Maxwell fluid: elastic when quick, a liquid when slow."""

    FAMILY = "visco"

    constitutive_model: Literal["viscoelastic"] = about(
        "material", "constitutive model"
    )
    relaxation_time: float = about(
        "material",
        "time in which shear stress decays to 1/e",
        "s",
        ge=1e-4,
        le=1e4,
        kind="time",
    )

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress, and volume as of liquids."""
        numbers = self.moduli() | {"time": self.relaxation_time}
        return {"deform": numbers, "deformation.settle": {}}


@ti.func
def maxwell(F, loose, E, nu, time):
    """Shear that decays within `time` [Fang et al. 2019]; parts beyond a tenth.

    F, the volume gained by parting, which it loses before it resists again; stress.
    """
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, r, R, D = parts(F)
    r /= 1.0 + DT / time
    new_loose, J = ti.max(J * loose / 1.1, 1.0), ti.min(J * loose, 1.1)
    mean = 0.5 * (mu + lam) * (J - 1.0 / J)
    tau = mean * mat2(1.0, 0.0, 0.0, 1.0) + 2.0 * mu * r * D @ R.transpose()
    return ti.sqrt(J / (1.0 - r * r)) * (R + r * D), new_loose, tau


@hook.stress
def deform(p, E, nu, time):
    F[p] += DT * C[p] @ F[p]
    F[p], loose[p], stress[p] = maxwell(F[p], loose[p], E, nu, time)
