"""What contacts have in common: the laws by which a surface acts on the grid.

The module of a law has two hooks for the velocity u of a node in contact with a surface
of outward normal n: `touch`, of one that stays where it is, and `meet`, of one that
moves at w. They may take the Coulomb coefficient. A third, `bound`, is for a node i, j
within the four walls.
"""

from mpmworlds.sim.program.words import (
    GRID,
    WALL,
    hook,
    vec2,
)


@hook.inwards
def inwards(i, j):
    n = 1.0 * (vec2(i, j) <= WALL) - 1.0 * (vec2(i, j) >= GRID - WALL)
    return n
