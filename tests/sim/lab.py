"""Functions of the physics library, evaluated in float64 for many inputs at once."""

import numpy as np
import taichi as ti
from hypothesis import settings
from hypothesis import strategies as st

N = 300  # inputs at once
generators = st.integers(0, 2**32 - 1).map(np.random.default_rng)
many = settings(max_examples=8, deadline=None)

ti.init(
    arch=ti.cpu,
    default_fp=ti.f64,
    cpu_max_num_threads=1,
    fast_math=False,
    offline_cache=False,
    log_level=ti.WARN,
)


def vectorised(function, width):
    """Map a taichi function from a vector to `width` values over the rows of an array.

    The result takes arrays that broadcast to (n, k), one for each of the k inputs, and
    returns one array (n,) for each output.
    """

    @ti.kernel
    def kernel(
        rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2), k: ti.template()
    ):
        for i in range(rows.shape[0]):
            given = ti.Vector([rows[i, j] for j in ti.static(range(k))])
            found = function(given)
            for j in ti.static(range(width)):
                out[i, j] = found[j]

    def apply(*columns):
        rows = np.stack(np.broadcast_arrays(*columns), axis=1).astype(np.float64)
        out = np.zeros((len(rows), width))
        kernel(np.ascontiguousarray(rows), out, rows.shape[1])
        return out.T

    return apply


def pair(matrix):
    """Complex a, b (n,) with M z = a z + b conj(z), of matrices (n, 2, 2)."""
    (xx, xy), (yx, yy) = matrix.transpose(1, 2, 0)
    return 0.5 * (xx + yy + 1j * (yx - xy)), 0.5 * (xx - yy + 1j * (yx + xy))


def matrix(a, b):
    """Matrices (n, 2, 2) of complex a, b (n,): the inverse of `pair`."""
    columns = a + b, 1j * (a - b)  # images of 1 and i
    rows = [[c.real for c in columns], [c.imag for c in columns]]
    return np.array(rows).transpose(2, 0, 1)


def parts(*numbers):
    """Real and imaginary parts of complex arrays, one after the other."""
    return [part for z in numbers for part in (z.real, z.imag)]


def symmetric(t, zx, zy):
    """Matrices t I + D(z) (n, 2, 2)."""
    return matrix(t + 0j, zx + 1j * zy)


def turns(angle):
    """Rotations (n, 2, 2)."""
    return matrix(np.exp(1j * angle), 0 * angle + 0j)


def deformations(rng, low, high):
    """Random F (N, 2, 2) of any orientation with singular values in [low, high]."""
    left, right = (turns(rng.uniform(0, 2 * np.pi, N)) for _ in range(2))
    s = rng.uniform(low, high, (N, 2))
    return left @ (s[:, :, None] * np.eye(2)) @ right
