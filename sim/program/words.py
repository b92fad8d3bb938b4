"""The words of programs, as placeholders: features are read as text and never run.

Hooks and functions of programs use names that only a program has: Taichi's, its
numbers, its fields, and the local names of its kernels. Importing them from here makes
the sources real Python for linters and readers, and keeps Taichi out of the schema.
"""

from typing import Any


class Word:
    """Stands for whatever its name stands for in a program."""

    def __getattr__(self, name: str) -> Any:
        """Any attribute is a word, too."""
        return self

    def __call__(self, *values: Any, **named: Any) -> Any:
        """Any call gives a word, too."""
        return self

    def __mul__(self, other: Any) -> Any:
        return self

    __add__ = __sub__ = __truediv__ = __pow__ = __mul__
    __radd__ = __rsub__ = __rtruediv__ = __rmul__ = __mul__


hook: Any = Word()  # marks code that a program gets at a place of the outline

# Of Taichi
ti: Any = Word()
cconj: Any = Word()
clamp: Any = Word()
cmul: Any = Word()
cross: Any = Word()
ivec3: Any = Word()
mat2: Any = Word()
vec2: Any = Word()
vec3: Any = Word()
vec4: Any = Word()

# Numbers of a scene
AREA: Any = Word()  # of a particle at rest [m^2]
DT: Any = Word()  # time step [s]
DX: Any = Word()  # size of a cell [m]
GRID: Any = Word()  # cells per side
MASS: Any = Word()  # of a particle, if all are alike [kg]
WALL: Any = Word()  # cells of a wall
N: Any = Word()  # particles
Node: Any = Word()  # what a node of the grid has
SPACING: Any = Word()  # of particles at rest [m]

# Fields of every scene of particles
C: Any = Word()  # velocity gradients [1/s]
x: Any = Word()  # places [m]
v: Any = Word()  # velocities [m/s]

# Fields and functions of scenes in which something solid moves
pose: Any = Word()  # of solids: center [m]; cosine and sine of the angle
twist: Any = Word()  # of solids: velocity [m/s] and spin [rad/s]
surface: Any = Word()  # signed distance of a solid and its normal

# What the outline gives to hooks
FRAMES: Any = Word()
GRAVITY: Any = Word()
PALETTE: Any = Word()
PIXELS: Any = Word()
RATE: Any = Word()
SERIAL: Any = Word()
SOLIDS: Any = Word()
START: Any = Word()
SUBSTEPS: Any = Word()
X: Any = Word()
Y: Any = Word()
balls: Any = Word()
birth: Any = Word()
grid: Any = Word()
flow: Any = Word()
spread: Any = Word()
ivec2: Any = Word()
mass: Any = Word()
solid: Any = Word()
stress: Any = Word()
near: Any = Word()
still: Any = Word()
RELEASED: Any = Word()
time: Any = Word()
rims: Any = Word()
touching: Any = Word()
hit: Any = Word()
spot: Any = Word()
ease: Any = Word()
rough: Any = Word()
kick: Any = Word()
BODIES: Any = Word()
MESHES: Any = Word()
TRIANGLES: Any = Word()
triangle: Any = Word()
rest: Any = Word()
J: Any = Word()
each: Any = Word()
POINTS: Any = Word()
cv2: Any = Word()
sys: Any = Word()
