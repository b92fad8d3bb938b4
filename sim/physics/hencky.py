"""Logarithmic strain [Hencky]: its mean m and half difference g, and their stress.

The principal log strains of F are m + g and m - g, so 2 m is the log of its volume
ratio; m and g return to F as exp(m + g) and exp(m - g), its singular values.
"""

import taichi as ti
from taichi.math import cmul


@ti.func
def hencky(a, b):
    """Mean m and half difference g >= 0 of the log strains of F = (a, b).

    Singular values below 0.05, and those of an inverted F, count as 0.05.
    """
    A, B = a.norm(), b.norm()
    e1, e2 = ti.log(ti.max(A + B, 0.05)), ti.log(ti.max(A - B, 0.05))
    return 0.5 * (e1 + e2), 0.5 * (e1 - e2)


@ti.func
def hencky_stress(a, b, m, g, mu, lam):
    """Kirchhoff stress t, z of log strains m + g, m - g along the axes of F = (a, b).

    tau = 2 mu e + lam tr(e) I; its mean is 2 (mu + lam) m, its largest shear 2 mu g.
    """
    AB = ti.max(a.norm() * b.norm(), 1e-12)
    return 2.0 * (mu + lam) * m, 2.0 * mu * g / AB * cmul(a, b)


@ti.func
def loosen(m, q, most):
    """Matter that parts where the mean log strain m passes `most`: new m and q.

    The log volume beyond, q - 1, is no strain; it is undone before matter resists
    again, so that parting gains no volume [Tampubolon et al. 2017].
    """
    new_m = m + 0.5 * (q - 1.0)
    return ti.min(new_m, most), 1.0 + 2.0 * ti.max(new_m - most, 0.0)


@ti.func
def settle_strain(a, b, crowd, dt):
    """Relax the volume of F = (a, b) within 5 ms where the filled space says so.

    As `settle`, for fluids that bear tension: where `crowd`, the part of space that
    matter and solids here would fill at rest, is below 0.9, pressure fades and holes
    close; above 1.1 it builds up.
    """
    J = a.dot(a) - b.dot(b)
    aim = J
    if crowd < 0.9:
        aim = ti.max(J, 1.0)
    elif crowd > 1.1:
        aim = ti.min(J, ti.max(1.0 / crowd, 0.8))
    s = 1.0 + 0.5 * dt / 0.005 * (aim / J - 1.0)
    return s * a, s * b
