"""2 x 2 matrices as pairs of complex numbers: M z = a z + b conj(z).

`a` turns and scales, `b` shears. The singular values are |a| + |b| and |a| - |b|, the
determinant is |a|^2 - |b|^2 and the polar rotation is a / |a|, so isotropic laws need
neither an SVD nor trigonometry. A symmetric matrix t I + D(z), with
D(z) = [[Re z, Im z], [Im z, -Re z]], is the pair (t, z).
"""

import taichi as ti
from taichi.math import cconj, cmul


@ti.func
def advance(a, b, c, d, dt):
    """F <- (I + dt C) F for F = (a, b) and velocity gradient C = (c, d) [1/s]."""
    da = cmul(c, a) + cmul(d, cconj(b))
    db = cmul(c, b) + cmul(d, cconj(a))
    return a + dt * da, b + dt * db


@ti.func
def newtonian(t, z, eta, c, d):
    """Add the viscous stress eta (C + C^T), eta [Pa s], to the stress t I + D(z)."""
    return t + 2.0 * eta * c.x, z + 2.0 * eta * d


@ti.func
def restretch(a, b, s1, s2):
    """F = (a, b) with its singular values replaced by s1 >= s2, rotations kept."""
    new_a = a * (0.5 * (s1 + s2) / ti.max(a.norm(), 1e-9))
    new_b = b * (0.5 * (s1 - s2) / ti.max(b.norm(), 1e-9))
    return new_a, new_b
