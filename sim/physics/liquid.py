"""Weakly compressible liquid: its whole state is the volume ratio J."""

import taichi as ti


@ti.func
def compress(J, c, dt, K):
    """Volume ratio J <- J (1 + dt tr C), and its stress tau = -J p for modulus K [Pa].

    p = K (1 - J), but no tension: free surfaces part [Tampubolon et al. 2017].
    """
    new_J = ti.min(ti.max(J * (1.0 + 2.0 * dt * c.x), 0.6), 1.1)
    return new_J, ti.min(K * new_J * (new_J - 1.0), 0.0)


@ti.func
def settle(J, crowd, dt):
    """Relax J within 5 ms where the space that is filled contradicts it.

    `crowd` is the part of space that matter and solids here would fill at rest.
    Splashing loses track of volume; liquid that is over a tenth thinner or denser than
    at rest returns to rest, and so keeps its volume [as in density correction].
    """
    rate = ti.select(abs(crowd - 1.0) > 0.1, dt / 0.005, 0.0)
    return J + rate * (ti.min(ti.max(1.0 / crowd, 0.8), 1.1) - J)
