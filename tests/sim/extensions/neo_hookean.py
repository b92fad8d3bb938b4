"""Rubber: compressible neo-Hookean elasticity [Simo and Pister 1984]."""

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


class NeoHookean(Solid):
    """Neo-Hookean elasticity, which is stiffer in large stretch than corotated."""

    FAMILY = "elastic/plastic"
    TEARS_AT = 5.0

    constitutive_model: Literal["neo_hookean"] = about("material", "constitutive model")
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
        damped = {"elastic.damp": {"eta": self.damping}} if self.damping else {}
        return {"deform": self.moduli()} | damped


@ti.func
def neo_hookean(F, E, nu):
    """Kirchhoff stress mu (F F^T - I) + lam / 2 (J^2 - 1) I [Simo and Pister 1984]."""
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    I, J = mat2(1.0, 0.0, 0.0, 1.0), F.determinant()
    return mu * (F @ F.transpose() - I) + 0.5 * lam * (J * J - 1.0) * I


@hook.stress
def deform(p, E, nu):
    F[p] += DT * C[p] @ F[p]
    stress[p] = neo_hookean(F[p], E, nu)
