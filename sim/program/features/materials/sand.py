"""Sand: Hencky strain, Mohr-Coulomb cone in 2D [Klar et al. 2016].

At the tip of the cone grains part, and gain a volume that they lose before they touch
again [Tampubolon et al. 2017].

Each transfer from particles to the grid and back filters velocities, so that shorter
steps would brake grains more: a column of sand would reach 4 % less far with half the
step. What the grid cannot hold of a velocity therefore stays with the particle, as in
FLIP [Brackbill and Ruppel 1986], and fades at a rate per time.
"""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.deformation import F, parts
from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.fields import node, particle
from mpmworlds.sim.program.words import (
    DT,
    DX,
    C,
    hook,
    mass,
    mat2,
    stress,
    ti,
    v,
    vec2,
)
from mpmworlds.sim.scene.fields import about

loose = particle("float", "1.0", "volume that matter gained by parting, a ratio")
carried = node("vec2", "", "momentum but for stress [kg m/s]")
old = node("vec2", "", "velocity that it makes [m/s]")
KEEPS: dict[str, Numbers] = {
    f"sand.{name}": {} for name in ("note", "remember", "keep", "gather_and_keep")
}


class Grains(Solid):
    """Grains with Mohr-Coulomb friction."""

    FAMILY = "sand"

    friction_angle_deg: float = about(
        "material",
        "internal friction angle",
        "deg",
        default=35.0,
        ge=5.0,
        le=60.0,
        kind="friction",
    )


class Sand(Grains):
    """Dry sand: Mohr-Coulomb friction, no cohesion."""

    constitutive_model: Literal["sand"] = about("material", "constitutive model")

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress."""
        return {"deform": self.moduli() | {"phi": self.friction_angle_deg}} | KEEPS


@ti.func
def sand(F, loose, E, nu, sin, bond):
    """Mohr-Coulomb [Klar et al. 2016]: F, volume gained by parting, Kirchhoff stress.

    Shear is at most bond - t sin(phi) at mean stress t; grains part at the tip.
    """
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, r, R, D = parts(F)
    tip = bond / (sin * (mu + lam))
    J, most = J * loose, tip + ti.sqrt(1.0 + tip * tip)
    new_loose, J = ti.max(J / most, 1.0), ti.min(J, most)
    mean = 0.5 * (mu + lam) * (J - 1.0 / J)
    r = ti.min(r, 0.5 * (bond - mean * sin) / mu)
    tau = mean * mat2(1.0, 0.0, 0.0, 1.0) + 2.0 * mu * r * D @ R.transpose()
    return ti.sqrt(J / (1.0 - r * r)) * (R + r * D), new_loose, tau


@hook.note
def note(i, j, p, base, w, f):
    mv = mass[p] * (v[p] + DX * C[p] @ (vec2(i, j) - f))
    carried[base.x + i, base.y + j] += w[i].x * w[j].y * mv


@hook.remember
def remember(i, j, m):
    old[i, j], carried[i, j] = carried[i, j] / m, vec2(0.0)


@hook.keep
def keep(p, base, w):
    fine = v[p]  # less what the grid holds of it; fades within 2 ms
    for i, j in ti.static(ti.ndrange(3, 3)):
        fine -= w[i].x * w[j].y * old[base.x + i, base.y + j]
    return fine


@hook.gather
def gather_and_keep(p, fine, g, G):
    v[p], C[p] = g.xy + fine / (1.0 + DT / 0.002), 4.0 / DX * G


@hook.stress
def deform(p, E, nu, phi):
    F[p] += DT * C[p] @ F[p]
    sin = ti.static(np.sin(np.radians(phi)))
    F[p], loose[p], stress[p] = sand(F[p], loose[p], E, nu, sin, 0.0)
