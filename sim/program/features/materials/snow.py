"""Snow: elasticity that hardens under compaction [Stomakhin et al. 2013]."""

import math
from typing import Literal

from mpmworlds.sim.program.features.deformation import F, parts
from mpmworlds.sim.program.features.material import Numbers, Solid
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

Jp = particle("float", "1.0", "plastic volume ratio of snow")


class Snow(Solid):
    """Snow: yields beyond small strains and hardens under compaction."""

    FAMILY = "snow"
    COMPACTS = True

    constitutive_model: Literal["snow"] = about("material", "constitutive model")
    yield_compression: float = about(
        "material",
        "critical compression",
        default=2.5e-2,
        gt=0.0,
        le=0.5,
        kind="strain",
    )
    yield_stretch: float = about(
        "material", "critical stretch", default=5.0e-3, gt=0.0, le=0.5, kind="strain"
    )
    hardening_rate: float = about(
        "material",
        "exponent of hardening",
        default=10.0,
        ge=0.0,
        le=20.0,
        kind="exponent",
    )
    hardening_min: float = about(
        "material", "least hardening factor", default=0.1, gt=0.0, le=1.0, kind="ratio"
    )
    hardening_max: float = about(
        "material",
        "greatest hardening factor",
        default=5.0,
        ge=1.0,
        le=20.0,
        kind="ratio",
    )

    def wave_speed(self) -> float:
        """Pressure waves in fully hardened snow."""
        return super().wave_speed() * math.sqrt(self.hardening_max)

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress."""
        return {
            "deform": self.moduli()
            | {
                "low": self.hardening_min,
                "high": self.hardening_max,
                "xi": self.hardening_rate,
                "press": self.yield_compression,
                "pull": self.yield_stretch,
            }
        }


@ti.func
def snow(F, Jp, E, nu, press, pull, xi, low, high):
    """Stretches within [1 - press, 1 + pull]; F, plastic volume, Kirchhoff stress.

    Corotated elasticity times exp(xi (1 - Jp)), in [low, high] [Stomakhin et al. 2013].
    """
    J, r, R, D = parts(F)
    s = ti.sqrt(J / (1.0 - r * r))
    s1 = clamp(s * (1.0 + r), 1.0 - press, 1.0 + pull)
    s2 = clamp(s * (1.0 - r), 1.0 - press, 1.0 + pull)
    new_F = 0.5 * (s1 + s2) * R + 0.5 * (s1 - s2) * D
    new_Jp, new_J = clamp(Jp * J / (s1 * s2), 0.6, 20.0), s1 * s2
    z = clamp(xi * (1.0 - new_Jp), -3.0, 3.0) / 16.0
    h = clamp(((1.0 + z) / (1.0 - z)) ** 8, low, high)  # exp(16 z), within 4 %
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    pressure = lam * new_J * (new_J - 1.0) * mat2(1.0, 0.0, 0.0, 1.0)
    return new_F, new_Jp, h * (2.0 * mu * (new_F - R) @ new_F.transpose() + pressure)


@hook.stress
def deform(p, E, nu, press, pull, xi, low, high):
    F[p] += DT * C[p] @ F[p]
    F[p], Jp[p], stress[p] = snow(F[p], Jp[p], E, nu, press, pull, xi, low, high)
