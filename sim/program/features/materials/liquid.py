"""Weakly compressible liquid: its whole state is the volume ratio J."""

import math
from typing import Literal

from mpmworlds.sim.program.features.material import Material, Numbers
from mpmworlds.sim.program.fields import particle
from mpmworlds.sim.program.words import (
    DT,
    C,
    clamp,
    hook,
    mat2,
    stress,
    ti,
)
from mpmworlds.sim.scene.fields import about

J = particle("float", "1.0", "volume ratio of liquid")


class Liquid(Material):
    """Weakly compressible Newtonian liquid."""

    FAMILY = "liquid"
    GIVES_WAY = True

    constitutive_model: Literal["liquid"] = about("material", "constitutive model")
    bulk_modulus: float = about(
        "material", "stiffness in volume", "Pa", ge=1e2, le=1e9, kind="stiffness"
    )
    viscosity: float = about(
        "material",
        "dynamic viscosity",
        "Pa s",
        default=0.0,
        ge=0.0,
        le=1e4,
        kind="viscosity",
    )

    def wave_speed(self) -> float:
        """Sound: sqrt(K / rho)."""
        return math.sqrt(self.bulk_modulus / self.density)

    def kinematic_viscosity(self) -> float:
        """That of the liquid: eta / rho."""
        return self.viscosity / self.density

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress, and the volume that splashing loses track of."""
        return {"deform": {"K": self.bulk_modulus, "eta": self.viscosity}, "settle": {}}


@ti.func
def liquid(J, C, K, eta):
    """Volume ratio J after a step, and stress eta (C + C^T) - J K (1 - J) I."""
    new_J = clamp(J * (1.0 + DT * C.trace()), 0.6, 1.1)
    p = ti.max(K * (1.0 - new_J), 0.0)  # no tension: free surfaces part
    return new_J, eta * (C + C.transpose()) - new_J * p * mat2(1.0, 0.0, 0.0, 1.0)


@hook.stress
def deform(p, K, eta):
    J[p], stress[p] = liquid(J[p], C[p], K, eta)


@hook.settle
def settle(p, g):
    if abs(g.w - 1.0) > 0.05:  # splashes lose track of volume
        J[p] += DT / 0.005 * (clamp(1.0 / g.w, 0.8, 1.05) - J[p])
