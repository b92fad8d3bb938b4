"""Quadratic B-splines on the grid."""

import taichi as ti


@ti.func
def bspline(f):
    """Weights of 3 nodes per axis, for offset f in [0.5, 1.5) cells from the first."""
    return 0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2
