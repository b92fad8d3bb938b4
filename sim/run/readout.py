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


def read_state(program: ModuleType, step: int) -> tuple[int, int, list[Floats]]:
    """What `child._read_state` returns: counts of particles and solids, and numbers."""
    matter, solids = hasattr(program, "x"), hasattr(program, "pose")
    owned, weighed = hasattr(program, "owner"), hasattr(program, "mass")
    timed = hasattr(program, "birth")
    particles = np.zeros((program.x.shape[0] if matter else 0, 6), np.float32)
    poses = np.zeros((program.pose.shape[0] if solids else 0, 7), np.float32)
    any_field = program.x if matter else program.pose
    names = ("x", "v", "owner", "mass", "birth", "pose", "twist")
    fields: list[Any] = [getattr(program, name, any_field) for name in names]
    _copy(*fields, matter, owned, weighed, timed, solids, step, particles, poses)
    if not weighed:
        particles[:, 5] = np.nan
    x, v, owner, mass = np.split(particles, [2, 4, 5], axis=1)
    return len(particles), len(poses), [x, v, owner, mass, poses[:, :4], poses[:, 4:]]


@ti.kernel
def _copy(
    x: ti.template(),
    v: ti.template(),
    owner: ti.template(),
    mass: ti.template(),
    birth: ti.template(),
    pose: ti.template(),
    twist: ti.template(),
    matter: ti.template(),
    owned: ti.template(),
    weighed: ti.template(),
    timed: ti.template(),
    solids: ti.template(),
    step: int,
    particles: ARRAY,
    poses: ARRAY,
):
    ti.loop_config(serialize=True)
    for p in range(particles.shape[0]):
        if ti.static(matter):
            particles[p, 0], particles[p, 1] = x[p].x, x[p].y
            particles[p, 2], particles[p, 3] = v[p].x, v[p].y
        if ti.static(owned):
            particles[p, 4] = owner[p]
        if ti.static(weighed):
            particles[p, 5] = mass[p]
        if ti.static(timed):
            if birth[p] > step:
                particles[p, 4] = -1.0 - particles[p, 4]
    ti.loop_config(serialize=True)
    for k in range(poses.shape[0]):
        if ti.static(solids):
            for j in ti.static(range(4)):
                poses[k, j] = pose[k][j]
            for j in ti.static(range(3)):
                poses[k, 4 + j] = twist[k][j]
