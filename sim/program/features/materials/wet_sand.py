"""Wet sand: sand whose grains cohere, the more by menisci of water between them."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.deformation import F
from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.features.materials.sand import KEEPS, Grains, loose, sand
from mpmworlds.sim.program.fields import node, particle
from mpmworlds.sim.program.words import (
    AREA,
    DT,
    DX,
    C,
    hook,
    stress,
    ti,
)
from mpmworlds.sim.scene.fields import about

saturation = particle("float", "saturation", "part of the pores that water fills")
water = node("float", "0.0", "volume of liquid at rest [m^2]")


class WetSand(Grains):
    """Sand whose grains cohere, most at half saturation; liquid nearby soaks it."""

    constitutive_model: Literal["wet_sand"] = about("material", "constitutive model")
    cohesion: float = about(
        "material",
        "cohesion at half saturation",
        "Pa",
        default=2e3,
        ge=0.0,
        le=1e6,
        kind="strength",
    )
    saturation: float = about(
        "material",
        "wet part of the pores at the start",
        default=0.3,
        ge=0.0,
        le=1.0,
        kind="fraction",
    )

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress, the start, and what liquid does."""
        numbers = {"phi": self.friction_angle_deg, "most": self.cohesion}
        soaking: dict[str, Numbers] = {"soak": {}} if "liquid" in present else {}
        return {"deform": self.moduli() | numbers} | soaking | KEEPS

    def gives(self, other: str) -> dict[str, Numbers]:
        """Liquid makes itself felt."""
        return {"pour": {}} if other == "liquid" else {}


@ti.func
def cohesion(saturation, most):
    """Cohesion [Pa] by menisci: none dry or flooded [as Mitarai and Nori 2006]."""
    return 4.0 * most * saturation * (1.0 - saturation)


@hook.stress
def deform(p, E, nu, phi, most):
    F[p] += DT * C[p] @ F[p]
    sin, cos = ti.static(np.sin(np.radians(phi)), np.cos(np.radians(phi)))
    bond = cos * cohesion(saturation[p], most)
    F[p], loose[p], stress[p] = sand(F[p], loose[p], E, nu, sin, bond)


@hook.settle
def soak(p, base, w):
    wet = 0.0  # part of the pores around that liquid fills
    for i, j in ti.static(ti.ndrange(3, 3)):
        wet += w[i].x * w[j].y * water[base.x + i, base.y + j] / DX**2
    saturation[p] += DT / 0.1 * ti.min(wet, 1.0) * (1.0 - saturation[p])


@hook.scatter
def pour(p, base, w):
    for i, j in ti.static(ti.ndrange(3, 3)):
        water[base.x + i, base.y + j] += w[i].x * w[j].y * AREA
