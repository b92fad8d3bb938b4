"""Sand: Hencky strain, Mohr-Coulomb cone in 2D [Klar et al. 2016]."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.deformation import F, parts
from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.fields import particle
from mpmworlds.sim.program.words import (
    DT,
    C,
    hook,
    mat2,
    ti,
)
from mpmworlds.sim.scene.fields import about

loose = particle("float", "1.0", "volume that matter gained by parting, a ratio")


class Grains(Solid):
    """Grains with Mohr-Coulomb friction."""

    FAMILY = "sand"

    friction_angle_deg: float = about(
        "material", "internal friction angle", "deg", default=35.0, ge=5.0, le=60.0
    )


class Sand(Grains):
    """Dry sand: Mohr-Coulomb friction, no cohesion."""

    constitutive_model: Literal["sand"] = about("material", "constitutive model")

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress."""
        return {"stress": self.moduli() | {"phi": self.friction_angle_deg}}


@ti.func
def sand(F, loose, E, nu, sin, bond):
    """Mohr-Coulomb [Klar et al. 2016]: F, volume gained by parting, Kirchhoff stress.

    Shear is at most bond - t sin(phi) at the mean stress t; at the tip of that cone
    grains part, and gain what they lose before they touch again [Tampubolon 2017].
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


@hook.stress
def stress(p, E, nu, phi):
    F[p] += DT * C[p] @ F[p]
    sin = ti.static(np.sin(np.radians(phi)))
    F[p], loose[p], tau = sand(F[p], loose[p], E, nu, sin, 0.0)
    return tau
