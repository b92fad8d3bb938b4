"""Weakly compressible liquid: its whole state is the volume ratio J."""

import taichi as ti


@ti.func
def compress(J, c, dt, K):
    """Volume ratio J <- J (1 + dt tr C), and its stress tau = -J p for modulus K [Pa].

    p = K (J^-7 - 1) / 7 [Tait; Monaghan 1994], but no tension: free surfaces part.
    """
    new_J = ti.min(ti.max(J * (1.0 + 2.0 * dt * c.x), 0.6), 1.1)
    J2 = new_J * new_J
    return new_J, ti.min(new_J * K / 7.0 * (1.0 - 1.0 / (J2 * J2 * J2 * new_J)), 0.0)


@ti.func
def settle(J, crowd, dt):
    """Relax J within 5 ms where density on the grid, relative to rest, contradicts it.

    Splashing loses track of volume; this returns liquid that is thinner or denser than
    at rest by over a tenth to rest, and keeps its volume [as in density correction].
    """
    new_J = J
    if crowd < 0.9 or crowd > 1.1:
        new_J += dt / 0.005 * (ti.min(ti.max(1.0 / crowd, 0.8), 1.1) - J)
    return new_J
