"""Elastic bodies as triangle meshes, whose vertices are particles [Jiang et al. 2015].

Forces of the mesh act on its vertices, and the grid makes bodies meet.
"""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.features.materials.liquid import J
from mpmworlds.sim.program.words import (
    AREA,
    DT,
    MESHES,
    SERIAL,
    SPACING,
    TRIANGLES,
    C,
    clamp,
    hook,
    ivec3,
    mass,
    mat2,
    rest,
    stress,
    ti,
    triangle,
    v,
    vec2,
    x,
)
from mpmworlds.sim.scene.fields import about


class ElasticFem(Solid):
    """Fixed corotated elasticity of a triangle mesh, which never tears."""

    FAMILY = "elastic/plastic"
    FLOWS = False

    constitutive_model: Literal["elastic_fem"] = about("material", "constitutive model")
    damping: float = about(
        "material",
        "Kelvin-Voigt viscosity",
        "Pa s",
        default=0.0,
        ge=0.0,
        le=1e4,
        kind="viscosity",
    )

    def wave_speed(self) -> float:
        """Faster by a third: triangles at the outline are thinner than a lattice's."""
        return 1.35 * super().wave_speed()

    def kinematic_viscosity(self) -> float:
        """That of the damping: eta / rho."""
        return self.damping / self.density

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Moduli of triangles; of particles, damping alone."""
        damped = {"elastic.damp": {"eta": self.damping}} if self.damping else {}
        crowded = {"resist": {"K": 2.0 * self.youngs_modulus}}
        return {"tighten": self.moduli()} | crowded | damped


def mesh(k, density, distance, u=0.0, v=0.0):
    """Rows of the vertices of body k, and its triangles, three vertices each.

    The vertices are points of a lattice; those next to the outline are moved onto it.
    """
    i, j = np.mgrid[: round(1 / SPACING), : round(1 / SPACING)]
    x, y = SPACING * (i + 0.5), SPACING * (j + 0.5)
    far = distance(x, y) + 1e-9  # so that half a spacing is not on both sides
    off = np.where(abs(far) <= SPACING / 2, far, 0) / 2e-4
    x, y = (
        x - off * (distance(x + 1e-4, y) - distance(x - 1e-4, y)),
        y - off * (distance(x, y + 1e-4) - distance(x, y - 1e-4)),
    )
    number = np.where(far <= SPACING / 2, np.arange(far.size).reshape(far.shape), -1)
    square = np.stack(
        [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    )
    square = square.reshape(4, -1)[:, (square >= 0).sum(axis=0).ravel() >= 3]
    last = np.where(square.min(axis=0) < 0, square.argmin(axis=0), square[0] % 2)
    square = np.take_along_axis(square, (np.arange(4)[:, None] + last + 1) % 4, 0)
    other = square[:, square[3] >= 0][[2, 3, 0]]
    triangles = np.concatenate([square[:3], other], axis=1)
    (x0, x1, x2), (y0, y1, y2) = x.ravel()[triangles], y.ravel()[triangles]
    area = ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2
    whole = area > AREA / 8
    used, triangles = np.unique(triangles[:, whole], return_inverse=True)
    share = np.bincount(triangles.ravel(), np.tile(area[whole] / 3, 3))
    rows = [k, density * share, x.ravel()[used], y.ravel()[used]]
    hook.throw(rows, u, v)
    return np.stack(np.broadcast_arrays(*rows), axis=1), triangles.reshape(3, -1).T


@hook.throw
def throw(rows, u, v):
    rows += [u, v]


@hook.section
def triangulate_one(k, density, distance, u, v):
    START, TRIANGLES = mesh(k, density, distance, u, v)
    return START, TRIANGLES


@hook.section
def triangulate():
    FIRST = np.cumsum([0, *(len(rows) for rows, _ in MESHES)])
    TRIANGLES = [n + first for (_, n), first in zip(MESHES, FIRST, strict=False)]
    TRIANGLES = np.concatenate(TRIANGLES).astype(np.int32)
    return TRIANGLES


@hook.section
def fields():
    triangle = ti.Vector.field(3, int, len(TRIANGLES))  # its corners
    rest = ti.Matrix.field(2, 2, float, len(TRIANGLES))  # inverse of its edges at rest
    return triangle, rest


@ti.func
def first_piola(F, E, nu):
    """P = 2 mu (F - R) + lam (J - 1) J F^-T [Stomakhin et al. 2012]."""
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, c, s = F.determinant(), F[0, 0] + F[1, 1], F[1, 0] - F[0, 1]
    R = mat2(c, -s, s, c) / ti.max(ti.sqrt(c * c + s * s), 1e-9)  # of F = R S
    cofactor = mat2(F[1, 1], -F[1, 0], -F[0, 1], F[0, 0])  # J F^-T
    return 2.0 * mu * (F - R) + lam * (J - 1.0) * cofactor


@ti.func
def apply_forces():
    """Accelerate the corners of triangles by their elastic forces."""
    ti.loop_config(serialize=SERIAL)
    for n in range(triangle.shape[0]):
        p, j, k = triangle[n]
        F = mat2(x[j] - x[p], x[k] - x[p]).transpose() @ rest[n]
        P = hook.tighten(p, F)
        forces = -0.5 * DT / rest[n].determinant() * P @ rest[n].transpose()
        at_j, at_k = vec2(forces[0, 0], forces[1, 0]), vec2(forces[0, 1], forces[1, 1])
        v[j] += at_j / mass[j]
        v[k] += at_k / mass[k]
        v[p] -= (at_j + at_k) / mass[p]


@hook.tighten
def tighten(p, F, E, nu):
    P = first_piola(F, E, nu)
    return P


@hook.place
def weave(triangles):
    for n in triangle:
        i, j, k = triangles[n, 0], triangles[n, 1], triangles[n, 2]
        triangle[n] = ivec3(i, j, k)
        rest[n] = mat2(x[j] - x[i], x[k] - x[i]).transpose().inverse()


@hook.stress
def resist(p, K):
    J[p] = clamp(J[p] * (1.0 + DT * C[p].trace()), 0.1, 1.1)  # against tangles
    stress[p] = K * ti.min(J[p] - 0.7, 0.0) * mat2(1.0, 0.0, 0.0, 1.0)
