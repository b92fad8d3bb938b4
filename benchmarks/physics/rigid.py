"""Rigid bodies: buoyancy, collisions, and the push of a jet."""

import numpy as np
from benchmarks.physics.case import (
    Curve,
    Floats,
    Plot,
    Result,
    at_least,
    at_most,
    case,
    near,
)
from benchmarks.physics.world import (
    WALL,
    block,
    body,
    box,
    cut,
    matter,
    nozzle,
    simulate,
    world,
)

from mpmworlds.sim.run.states import invariants


@case(coarse=48, fine=96)
def a_block_floats_as_deep_as_its_density(cells: int) -> Result:
    """Draught over height is the ratio of densities [Archimedes]."""
    edge, width, height = WALL / cells, 0.32, 0.12
    deep, ratio, tank = cut(0.3, cells), 0.5, 1 - 2 * edge
    syrup = matter("liquid", viscosity=5.0)
    scene = world(
        body(block(edge, edge, tank, deep), syrup),
        body(block(0.34, edge + deep, width, height), matter("rigid", 1e3 * ratio)),
        cells=cells,
        seconds=4.0,
        frame=0.05,
    )
    record = simulate(scene)
    bottom = record.pose(1)[:, 1] - 0.5 * height
    level = np.array([surface(x, cells, 0.5 * width + 0.04) for x in record.x(0)])
    draught = level - bottom
    last = draught[-20:].mean()
    tilt = np.degrees(abs(record.pose(1)[-20:, 2]).max())
    source = "Archimedes"
    curves = [
        Curve("simulated", record.time, draught / height),
        Curve(source, record.time[[0, -1]], [ratio, ratio], reference=True),
    ]
    return Result(
        [
            near("draught / height", last / height, ratio, 0.2, source),
            at_most("tilt [deg]", tilt, 10.0, "stability"),
        ],
        [Plot("Floating block", "t [s]", "draught / height", curves)],
    )


def surface(x: Floats, cells: int, away: float) -> float:
    """Height [m] of the surface of a pool (n, 2) farther than that from the middle."""
    columns = np.floor(x[:, 0] * cells).astype(int)
    inside = (abs(x[:, 0] - 0.5) > away) & (abs(x[:, 0] - 0.5) < 0.45 - WALL / cells)
    tops = [x[columns == i, 1].max() for i in sorted(set(columns[inside]))]
    return float(np.mean(tops)) + 0.25 / cells


@case(coarse=32, fine=64)
def a_collision_of_rigid_bodies_keeps_momentum(cells: int) -> Result:
    """Two boxes meet off their centers, without gravity."""
    scene = world(
        body(box((0.3, 0.5), 0.15, 0.15), matter("rigid"), (1.0, 0.0)),
        body(box((0.62, 0.58), 0.15, 0.2, angle=10), matter("rigid", 500.0)),
        body(box((0.15, 0.15), 0.1, 0.1), matter("elastic")),
        cells=cells,
        seconds=0.4,
        gravity=(0.0, 0.0),
    )
    states = simulate(scene).states
    found = invariants(states, states.gravity)
    first = np.hypot(*found["momentum"][0])
    momentum = np.hypot(*(found["momentum"] - found["momentum"][0]).T).max() / first
    turning = found["angular_momentum"]
    spread = abs(turning - turning[0]).max() / abs(turning[0])
    energy = found["kinetic_energy"]
    hit = abs(states.rates[-1, 1, 0])
    source = "conservation"
    return Result(
        [
            at_least("speed that the second one gets [m/s]", hit, 0.1, "they meet"),
            at_most("change of momentum", momentum, 1e-5, source),
            at_most("change of angular momentum", spread, 0.01, source),
            at_most(
                "largest energy / first", (energy / energy[0]).max(), 1.001, source
            ),
        ]
    )


@case(coarse=48, fine=96)
def a_jet_off_the_center_turns_a_plank_its_way(cells: int) -> Result:
    """Upwards on the right: anticlockwise. Momentum is what was emitted."""
    spacing = 0.5 / cells
    speed, side, stop = 1.5, 0.08, 0.25
    rate = 0.9 * side * speed / spacing**2
    emission = {"type": "jet", "rate": rate, "velocity": [0.0, speed], "stop": stop}
    scene = world(
        body(box((0.45, 0.4), 0.3, 0.06), matter("rigid", 500.0)),
        nozzle(box((0.56, 0.2), side, 0.04), emission),
        cells=cells,
        seconds=0.35,
        gravity=(0.0, 0.0),
    )
    record = simulate(scene)
    states = record.states
    found = invariants(states, states.gravity)["momentum"]
    count = states.born.sum(axis=1)
    given = count * states.mass[0] * speed
    off = np.hypot(found[:, 0], found[:, 1] - given).max() / given[-1]
    rate_last = record.rate(0)[-1]
    source = "conservation"
    return Result(
        [
            at_least("spin [rad/s]", rate_last[2], 0.5, "sign"),
            at_least("speed upwards [m/s]", rate_last[1], 0.1, "sign"),
            at_most("momentum off what was emitted", off, 1e-3, source),
        ]
    )
