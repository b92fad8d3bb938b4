"""What materials have in common."""

import math
from typing import TYPE_CHECKING, ClassVar

from mpmworlds.sim.scene.fields import Part, about

DENSITY = {"ge": 1.0, "le": 1e5}
Numbers = dict[str, float]


class Material(Part):
    """What every material has."""

    FAMILY: ClassVar[str]  # group in reports
    COMPACTS: ClassVar[bool] = False  # whether it may stay at a fraction of its volume
    FLOWS: ClassVar[bool] = True  # a nozzle may release it
    GIVES_WAY: ClassVar[bool] = False  # another nozzle may release into it
    TEARS_AT: ClassVar[float] = math.inf  # speed of what hits it [m/s], numerically

    if TYPE_CHECKING:
        constitutive_model: str

    density: float = about(
        "material", "mass per area at rest", "kg/m^2", **DENSITY, kind="density"
    )

    def wave_speed(self) -> float:
        """Speed of the fastest elastic wave [m/s]; it bounds the time step."""
        raise TypeError(f"{type(self).__name__} has no wave speed")

    def kinematic_viscosity(self) -> float:
        """Viscosity per density [m^2/s] of explicit stress; it bounds the time step."""
        return 0.0

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Hooks of the module that its particles go through, and the numbers they take.

        One of another module is named like `deformation.settle`. `present` names the
        materials of the scene.
        """
        raise TypeError(f"{type(self).__name__} has no hooks")

    def gives(self, other: str) -> dict[str, Numbers]:
        """Hooks of the module that particles of another material go through."""
        return {}


class Solid(Material):
    """A material with Young's modulus and Poisson's ratio."""

    youngs_modulus: float = about(
        "material", "stiffness", "Pa", ge=1e2, le=1e9, kind="stiffness"
    )
    poissons_ratio: float = about(
        "material", "lateral contraction", ge=0.0, le=0.45, kind="fraction"
    )

    def wave_speed(self) -> float:
        """Pressure waves: sqrt((lam + 2 mu) / rho)."""
        nu = self.poissons_ratio
        p_wave = self.youngs_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        return math.sqrt(p_wave / self.density)

    def moduli(self) -> Numbers:
        """Young's modulus E and Poisson's ratio nu."""
        return {"E": self.youngs_modulus, "nu": self.poissons_ratio}
