"""Weakly compressible liquid: its whole state is the volume ratio J."""

import taichi as ti


@ti.func
def compress(J, c, dt, K):
    """Volume ratio J <- J (1 + dt tr C), and its stress tau = -J p for modulus K [Pa].

    p = K (J^-7 - 1) / 7 [Tait; Monaghan 1994]. J is kept in [0.6, 1.005], because a
    free surface bears no tension.
    """
    new_J = ti.min(ti.max(J * (1.0 + 2.0 * dt * c.x), 0.6), 1.005)
    J2 = new_J * new_J
    return new_J, new_J * K / 7.0 * (1.0 - 1.0 / (J2 * J2 * J2 * new_J))
