"""What programs are made of, run in float64 for many inputs at once."""

import importlib.util
import tempfile
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np
import taichi as ti
from hypothesis import settings
from hypothesis import strategies as st

from mpmworlds.sim.program.linking.layout import indented
from mpmworlds.sim.program.linking.places import pasted, texts_of
from mpmworlds.sim.program.linking.source import library

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

HEAD = """\
import numpy as np
import taichi as ti
from taichi.math import cconj, clamp, cmul, cross, ivec2, ivec3, mat2, vec2, vec3, vec4
"""
KINDS = {
    "float": f"ti.field(float, {N})",
    "vec2": f"ti.Vector.field(2, float, {N})",
    "mat2": f"ti.Matrix.field(2, 2, float, {N})",
}
FOLDER = tempfile.TemporaryDirectory(prefix="lab")
NUMBERS = count()


def made(text="", **numbers):
    """A module of all functions of the library, some numbers, and a text.

    Names of programs that are not among the numbers are unbound: what reads them cannot
    be called.
    """
    parts = [HEAD, *(f"{name} = {value!r}" for name, value in numbers.items())]
    parts += [piece.text for piece in library().constants.values()]
    for piece in library().functions.values():
        if not piece.text.startswith("@ti.kernel") and "hook." not in piece.text:
            parts.append(piece.text)
    path = Path(FOLDER.name) / f"made_{next(NUMBERS)}.py"
    path.write_text("\n\n\n".join([*parts, text]) + "\n", "utf-8")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def functions(**numbers):
    """All functions of the library, for some numbers such as the time step DT."""
    return made(**numbers)


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


class Particles:
    """Code of hooks for particle p as a program has it, over arrays.

    Parameters
    ----------
    lines : list of str
        Statements, which may read and set fields of particles at p.
    outcome : str
        Name that they set, kept as field `outcome`; "" if there is none.
    inputs : dict of str to str
        Kind of other names that they read, given as fields.
    kind : str
        Of the outcome.
    numbers : dict
        Numbers of the program that they read, such as DT.
    """

    def __init__(self, lines, outcome="", inputs=None, kind="mat2", **numbers):
        given, text = inputs or {}, "\n".join(lines)
        known = {n: f for n, f in library().fields.items() if f"{n}[" in text}
        kinds = {name: field.kind for name, field in known.items()}
        kinds |= {"stress": "mat2"} if "stress[" in text else {}
        kinds |= {"C": "mat2", **given}
        kept = [f"outcome[p] = {outcome}"] if outcome else []
        body = [*(f"{name} = given_{name}[p]" for name in given), *lines, *kept]
        fields = {f"given_{n}" if n in given else n: kind for n, kind in kinds.items()}
        if outcome:
            fields["outcome"] = kind
        code = [f"{name} = {KINDS[kind]}" for name, kind in fields.items()]
        code += ["@ti.kernel", "def apply():", f"    for p in range({N}):"]
        self.module = made("\n".join([*code, *indented(body, 8)]), **numbers)
        self.given = given
        starts = {name: _value(field.start) for name, field in known.items()}
        self.starts = {n: start for n, start in starts.items() if start is not None}
        self.fields = list(fields)

    def __call__(self, **values):
        """Values of all fields after the code, by their names.

        Each value broadcasts to (n, ...) with n <= N; fields that are not given start
        as in a program, and C as 0.
        """
        values = {"C": np.zeros((2, 2))} | self.starts | values
        size = max(
            [len(v) for n, v in values.items() if np.ndim(v) > self._rank(n)], default=N
        )
        for name, value in values.items():
            field = self._field(name)
            shape = (size, *np.shape(field.to_numpy())[1:])
            whole = np.broadcast_to(value, shape)
            field.from_numpy(np.resize(whole, (N, *shape[1:])).astype(np.float64))
        self.module.apply()
        found = {name: getattr(self.module, name).to_numpy() for name in self.fields}
        return {name: array[:size] for name, array in found.items()}

    def _field(self, name):
        return getattr(self.module, f"given_{name}" if name in self.given else name)

    def _rank(self, name):
        return np.ndim(self._field(name).to_numpy()) - 1


def _value(start):
    """First value of a field; None if it is a number of the material."""
    numbers = {"mat2": lambda a, b, c, d: np.array([[a, b], [c, d]])}
    try:
        return eval(start, numbers)
    except NameError:
        return None


def code_of(hooks, model, place):
    """Statements of the hooks of a material at a place."""
    lines = []
    for key, numbers in hooks.items():
        module, _, name = key.rpartition(".")
        if library().hooks[module or model, name].place == place:
            lines += pasted(module or model, name, **texts_of(numbers))
    return lines


def turns(angle):
    """Rotations (n, 2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]).transpose(2, 0, 1)


def deformations(rng, low, high):
    """Random F (N, 2, 2) of any orientation with singular values in [low, high]."""
    left, right = (turns(rng.uniform(0, 2 * np.pi, N)) for _ in range(2))
    s = rng.uniform(low, high, (N, 2))
    return left @ (s[:, :, None] * np.eye(2)) @ right
