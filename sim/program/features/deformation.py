"""Deformation gradients: their parts, and stress near that of Hencky.

In the plane F = s (R + r D) with a rotation R, a reflection D, and s^2 = J / (1 - r^2):
the principal stretches are s (1 + r) and s (1 - r), so that r is the tanh of Hencky's
shear, and no law needs an SVD.

Hencky's law has the log of volume and shear. (J - 1 / J) / 2 and r stand for them:
within 2 % for |log J| < 0.35 and r < 0.25. Any such functions make a hyperelastic law,
and these have inverses without a log.
"""

from mpmworlds.sim.program.fields import particle
from mpmworlds.sim.program.words import (
    DT,
    clamp,
    hook,
    mat2,
    ti,
)

F = particle("mat2", "mat2(1.0, 0.0, 0.0, 1.0)", "deformation gradient")


@ti.func
def parts(F):
    """J, shear r, rotation R and reflection D of F = sqrt(J / (1 - r^2)) (R + r D)."""
    cofactor = mat2(F[1, 1], -F[1, 0], -F[0, 1], F[0, 0])
    R, D = F + cofactor, F - cofactor
    a, b = ti.max(ti.sqrt(R.determinant()), 0.2), ti.sqrt(-D.determinant())
    return ti.max(F.determinant(), 0.01), ti.min(b / a, 0.99), R / a, D / (b + 1e-9)


@hook.settle
def settle(p, g):
    if abs(g.w - 1.0) > 0.1:  # too empty or too full
        volume, aim = F[p].determinant(), clamp(1.0 / g.w, 0.8, 1.0)
        aim = ti.select(g.w < 1.0, ti.max(volume, aim), ti.min(volume, aim))
        F[p] *= 1.0 + 0.5 * DT / 0.005 * (aim / volume - 1.0)
