"""Solids and pastes: vibration, dents, yield and relaxation."""

import numpy as np
from benchmarks.physics.case import Curve, Plot, Result, at_least, at_most, case, near
from benchmarks.physics.world import (
    WALL,
    G,
    block,
    body,
    cut,
    machine,
    matter,
    simulate,
    world,
)


@case(coarse=64, fine=128)
def a_standing_bar_vibrates_at_the_frequency_of_theory(cells: int) -> Result:
    """Weight put on a clamped bar: period 4 L / c, mean sag g L^2 / (3 c^2)."""
    E, nu = 4e5, 0.3
    c = (E / (1 - nu**2) / 1e3) ** 0.5  # thin in the plane, no strain across it
    edge, length, width = WALL / cells, cut(0.6, cells), cut(0.15, cells)
    bars = [
        body(block(x, edge, width, length), matter(model))
        for x, model in ((cut(0.2, cells), "elastic"), (cut(0.6, cells), "elastic_fem"))
    ]
    scene = world(*bars, cells=cells, seconds=0.3, frame=0.002, walls="sticky")
    record = simulate(scene)
    checks, curves, sag = [], [], G * length**2 / (3 * c**2)
    for index, name in enumerate(("elastic", "elastic_fem")):
        y = record.x(index)[..., 1].mean(axis=1)
        speed = record.v(index)[..., 1].mean(axis=1)
        t = record.time
        turns = np.flatnonzero(speed[1:-1] * speed[2:] < 0.0) + 1
        turns = t[turns] + 0.002 * speed[turns] / (speed[turns] - speed[turns + 1])
        period = turns[2] - turns[0]
        whole = t <= turns[1]  # a period, as the bar starts at a turn
        source = "longitudinal wave in a thin bar"
        mean = y[0] - y[whole].mean()
        checks += [
            near(f"{name}: period [s]", period, 4 * length / c, 0.05, source),
            near(f"{name}: sag [m]", mean, sag, 0.08, source),
        ]
        curves.append(Curve(name, t * c / length, (y - y[0]) / sag))
    phase = np.linspace(0.0, 0.3 * c / length, 80)
    n = 2 * np.arange(20)[:, None] + 1
    series = (np.cos(0.5 * n * np.pi * phase) / n**4).sum(axis=0) * 96 / np.pi**4
    curves.append(Curve("theory", phase, series - 1.0, reference=True))
    plot = Plot("Center of mass of a bar", "t c / L", "u / sag", curves)
    return Result(checks, [plot])


@case(coarse=48, fine=96)
def a_plastic_body_keeps_its_dent_and_an_elastic_one_does_not(cells: int) -> Result:
    """A press squeezes two blocks by a tenth and lets go."""
    E, nu, k = 4e5, 0.3, 5e3
    edge, width, height = WALL / cells, cut(0.2, cells), cut(0.2, cells)
    lefts = cut(0.15, cells), cut(0.6, cells)
    plastic = matter("plastic", yield_stress=k)
    elastic = matter("elastic", damping=20.0)
    blocks = [
        body(block(left, edge, width, height), physics)
        for left, physics in zip(lefts, (plastic, elastic), strict=True)
    ]
    stroke = 0.1 * height
    swing = {
        "type": "oscillate",
        "amplitude": [0.0, 0.5 * stroke],
        "frequency": 1.0,
        "phase_deg": 90.0,
        "stop": 1.0,
    }
    press = machine(block(0.1, edge + height + stroke / 2, 0.8, 0.05), swing)
    press["shape"]["center"] = (0.5, edge + height + 0.025)
    scene = world(
        *blocks, press, cells=cells, seconds=1.3, frame=0.02, gravity=(0.0, 0.0)
    )
    record = simulate(scene)
    heights = []
    for index in range(2):
        y = record.x(index)[..., 1]
        spread = y.std(axis=1)
        heights.append(spread / spread[0])
    kept = 0.1 - 2 * k * (1 - nu**2) / E
    return Result(
        [
            near(
                "plastic: dent / height", 1 - heights[0][-1], kept, 0.2, "plane strain"
            ),
            at_most("elastic: dent / height", 1 - heights[1][-1], 0.01, "elasticity"),
        ],
        [
            Plot(
                "Height in a press",
                "t [s]",
                "h / h0",
                [
                    Curve(name, record.time, h)
                    for name, h in zip(("plastic", "elastic"), heights, strict=True)
                ],
            )
        ],
    )


@case(coarse=48, fine=96)
def a_bingham_heap_stands_below_its_yield_stress(cells: int) -> Result:
    """A cut stands up to a height of 3.64 to 3.83 k / (rho g), a higher one slumps.

    Weight that is put on all at once doubles the stress for a moment.
    """
    edge, width, height = WALL / cells, cut(0.2, cells), cut(0.25, cells)
    pastes = [
        matter("viscoplastic", yield_stress=part * 1e3 * G * height, consistency=10.0)
        for part in (0.05, 0.6)
    ]
    scene = world(
        body(block(edge, edge, width, height), pastes[0]),
        body(block(cut(0.75, cells), edge, cut(0.15, cells), height), pastes[1]),
        cells=cells,
        seconds=2.0,
        frame=0.1,
        walls="sticky",
    )
    record = simulate(scene)
    means = [record.x(i)[..., 1].mean(axis=1) - edge for i in range(2)]
    elastic = 1e3 * G * height / (4e5 / (1 - 0.3**2)) / 3 * 2  # of the mean height
    return Result(
        [
            at_least(
                "k = 0.6 rho g h: height / first",
                means[1][-1] / means[1][0],
                0.99 - elastic,
                "limit analysis (Chen 1975)",
            ),
            at_most(
                "k = 0.05 rho g h: height / first",
                means[0][-1] / means[0][0],
                0.75,
                "limit analysis (Chen 1975)",
            ),
        ],
        [
            Plot(
                "Heaps of a Bingham fluid",
                "t [s]",
                "h / h0",
                [
                    Curve(f"k = {part} rho g h", record.time, mean / mean[0])
                    for part, mean in zip((0.05, 0.6), means, strict=True)
                ],
            )
        ],
    )


@case(coarse=48, fine=96)
def stress_of_a_squeezed_maxwell_body_relaxes_in_its_time(cells: int) -> Result:
    """Squeezed between plates and held, free at its sides.

    Volume stays elastic, and the sides are free of stress; so shear strain decays in
    time (lam + 2 mu) / (lam + mu), which is relaxation_time 2 (1 - nu).
    """
    nu, time, held = 0.3, 0.2, 0.02
    edge, width, height = WALL / cells, cut(0.4, cells), cut(0.3, cells)
    gum = matter("viscoelastic", poissons_ratio=nu, relaxation_time=time)
    press = machine(
        block(0.1, edge + height, 0.8, 0.05),
        {"type": "translate", "velocity": [0.0, -0.04 * height / held], "stop": held},
    )
    scene = world(
        body(block(cut(0.3, cells), edge, width, height), gum),
        press,
        cells=cells,
        seconds=0.42,
        gravity=(0.0, 0.0),
    )
    record = simulate(scene, "F")
    stretches = np.linalg.svd(record.field("F", 0), compute_uv=False)
    x = record.x(0)[0]
    inner = (abs(x[:, 0] - x[:, 0].mean()) < 0.1) & (
        abs(x[:, 1] - x[:, 1].mean()) < 0.07
    )
    shear = 0.5 * np.log(stretches[..., 0] / stretches[..., 1])[:, inner].mean(axis=1)
    t = record.time
    late = t > 0.12
    found = -1.0 / np.polyfit(t[late], np.log(shear[late]), 1)[0]
    expected = time * 2 * (1 - nu)
    source = "Maxwell model, free sides"
    fitted = shear[late][0] * np.exp(-(t[late] - t[late][0]) / expected)
    curves = [
        Curve("simulated", t, shear),
        Curve(source, t[late], fitted, reference=True),
    ]
    return Result(
        [near("time of decay [s]", found, expected, 0.1, source)],
        [Plot("Stress relaxation", "t [s]", "shear strain", curves)],
    )
