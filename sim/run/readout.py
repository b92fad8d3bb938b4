"""Read the state of a running program by one kernel.

Taichi compiles a kernel for each field that it copies to NumPy, which takes a quarter
of a short trial. `zygote` loads this into the process of a program.
"""

from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import taichi as ti

ARRAY = ti.types.ndarray()
Floats = npt.NDArray[np.float32]


def read_state(program: ModuleType) -> tuple[int, int, list[Floats]]:
    """What `child._read_state` returns: living particles, substeps done, numbers."""
    solids = list(getattr(program, "COLLIDERS", []))
    counts = np.zeros(2, np.int32)
    matter = np.zeros((program.x.shape[0], 4), np.float32)
    rigid = np.zeros((getattr(program, "N_OBJECTS", 0) + 1, 8), np.float32)
    fields: list[Any] = [program.x, program.v, program.alive, program.clock]
    fields += [program.pose, program.twist] if solids else [program.x, program.v]
    _copy(*fields, bool(solids), counts, matter, rigid)
    living, steps = counts.tolist()
    numbers = [matter[:living, :2], matter[:living, 2:]]
    if solids:
        numbers += [rigid[solids, :4], rigid[solids, 4:]]
    return living, steps, numbers


@ti.kernel
def _copy(
    x: ti.template(),
    v: ti.template(),
    alive: ti.template(),
    clock: ti.template(),
    pose: ti.template(),
    twist: ti.template(),
    solids: ti.template(),
    counts: ARRAY,
    matter: ARRAY,
    rigid: ARRAY,
):
    ti.loop_config(serialize=True)
    for p in range(matter.shape[0]):
        matter[p, 0], matter[p, 1] = x[p].x, x[p].y
        matter[p, 2], matter[p, 3] = v[p].x, v[p].y
    ti.loop_config(serialize=True)
    for k in range(rigid.shape[0]):
        if k == 0:
            counts[0], counts[1] = alive[None], clock[None]
        if ti.static(solids):
            if k < pose.shape[0]:
                for j in ti.static(range(4)):
                    rigid[k, j] = pose[k][j]
                    rigid[k, 4 + j] = twist[k][j]
