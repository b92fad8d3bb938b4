"""Sand: run-out, slope, cohesion, soaking."""

import itertools

import numpy as np
from benchmarks.physics.case import (
    Check,
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
    cut,
    matter,
    obstacle,
    simulate,
    world,
)

LUBE = "Lube et al. 2005, Lajeunesse et al. 2005"
SAND = {"density": 1600.0, "youngs_modulus": 8e5, "poissons_ratio": 0.25}


def lube(a: float) -> float:
    """Run-out over width of a plane column of aspect ratio a [Lube et al. 2005].

    That of sand between plates; discs in a plane reach 2.5 a [Staron and Hinch 2005].
    """
    return 1.2 * a if a < 2.3 else 1.9 * a ** (2 / 3)


def pile(cells: int, width: float, aspect: float, phi: float) -> tuple[Floats, Floats]:
    """Positions (T, n, 2) [m] of a column in the corner above rough ground; times."""
    edge, width = WALL / cells, cut(width, cells)
    ground = obstacle(block(0.0, 0.0, 1.0, edge + 2 / cells), "sticky")
    grit = matter("sand", friction_angle_deg=phi, **SAND)
    column = body(block(edge, edge + 2 / cells, width, aspect * width), grit)
    lasts = 6.0 * (aspect * width / 9.8) ** 0.5 + 0.3
    scene = world(column, ground, cells=cells, seconds=lasts, frame=lasts / 40)
    record = simulate(scene)
    return record.x(0) - [edge, edge + 2 / cells], record.time


def foot(x: Floats, cells: int) -> float:
    """Extent [m] of a deposit: up to where it is thinner than half a cell."""
    columns = np.bincount(np.floor(x[:, 0] * cells).astype(int).clip(0))
    thin = np.flatnonzero(np.append(columns, 0) < 2)
    return float(thin[0]) / cells


def run_outs(cells: int, columns: dict[float, float]) -> Result:
    """Columns of some aspect ratios and widths [m], against the scaling."""
    found: dict[float, float] = {}
    checks: list[Check] = []
    for aspect, width in columns.items():
        x, _ = pile(cells, width, aspect, 31.0)
        wide = cut(width, cells)
        found[aspect] = foot(x[-1], cells) / wide - 1.0
        name = f"run-out / width at aspect ratio {aspect:g}"
        checks.append(near(name, found[aspect], lube(aspect), 0.35, LUBE))
    aspects = np.array(list(found))
    curves = [
        Curve("simulated", aspects, list(found.values())),
        Curve(LUBE, aspects, [lube(a) for a in found], reference=True),
    ]
    return Result(checks, [Plot("Collapse of sand", "h / d", "(d1 - d) / d", curves)])


@case(coarse=64, fine=128, slow=True)
def columns_of_sand_run_out_as_in_experiments(cells: int) -> Result:
    """Aspect ratios 1 and 4 suffice on coarse grids."""
    columns = {0.5: 0.3, 1.0: 0.25, 2.0: 0.18, 3.0: 0.15, 4.0: 0.13, 5.0: 0.11}
    coarse = {a: d for a, d in columns.items() if a in (1.0, 4.0)}
    return run_outs(cells, columns if cells > 64 else coarse)


@case(coarse=48, fine=96, slow=True)
def the_slope_of_sand_grows_with_its_friction_angle(cells: int) -> Result:
    """Square columns; the slope of what stays lies below the friction angle."""
    slopes, checks, curves = {}, [], []
    angles = (20.0, 30.0, 40.0) if cells > 48 else (20.0, 40.0)
    for phi in angles:
        x, _ = pile(cells, 0.25, 1.0, phi)
        edges = np.arange(0.0, 0.9, 1.0 / cells)
        rows = np.digitize(x[-1, :, 0], edges)
        tops = np.array(
            [x[-1, rows == i, 1].max(initial=0.0) for i in range(1, len(edges))]
        )
        inside = (tops < 0.8 * tops.max()) & (tops > 2.0 / cells)
        middle = 0.5 * (edges[1:] + edges[:-1])
        slope = np.polyfit(middle[inside], tops[inside], 1)[0]
        slopes[phi] = float(np.degrees(np.arctan(-slope)))
        curves.append(Curve(f"{phi:g} deg", middle, tops))
        name = f"slope at {phi:g} deg [deg]"
        checks.append(at_most(name, slopes[phi], phi + 3.0, "Mohr-Coulomb"))
    low, high = slopes[angles[0]], slopes[angles[-1]]
    for i, j in itertools.pairwise(angles):
        more, name = slopes[j] - slopes[i], f"slope at {j:g} - slope at {i:g} deg [deg]"
        checks.append(at_least(name, more, 2.0, "monotone"))
    name = f"slope at {angles[-1]:g} / slope at {angles[0]:g} deg"
    checks.append(at_least(name, high / low, 1.2, "monotone"))
    return Result(checks, [Plot("Piles of sand", "x [m]", "y [m]", curves)])


@case(coarse=64, fine=128)
def a_slope_of_sand_holds_below_its_friction_angle(cells: int) -> Result:
    """Two wedges with a slope of 25 degrees: friction of 35 degrees, and of 15."""
    ground, length = (WALL + 2) / cells, 0.4
    rough = obstacle(block(0.0, 0.0, 1.0, ground), "sticky")
    rise = length * np.tan(np.radians(25.0))
    things = []
    for side, phi in ((1.0, 35.0), (-1.0, 15.0)):
        corner = 0.5 - side * (0.5 - WALL / cells), ground
        corners = [[0.0, 0.0], [side * length, 0.0], [0.0, rise]]
        wedge = {"type": "polygon", "center": corner, "vertices": corners}
        things.append(body(wedge, matter("sand", friction_angle_deg=phi, **SAND)))
    record = simulate(world(*things, rough, cells=cells, seconds=1.0, frame=0.05))
    falls = []
    for index in range(2):
        height = record.x(index)[..., 1].mean(axis=1) - ground
        falls.append(1.0 - height[-1] / height[0])
    return Result(
        [
            at_most("35 deg: fall of the center / height", falls[0], 0.03, "Coulomb"),
            at_least("15 deg: fall of the center / height", falls[1], 0.1, "Coulomb"),
        ]
    )


@case(coarse=48, fine=96)
def a_damp_column_of_sand_stands_dry_and_flooded_ones_fall(cells: int) -> Result:
    """Cohesion c holds a cut of height 4 c tan(45 + phi / 2) / (rho g) at most."""
    edge, width, height = WALL / cells, cut(0.1, cells), cut(0.25, cells)
    rough = obstacle(block(0.0, 0.0, 1.0, edge + 2 / cells), "sticky")
    bottom = edge + 2 / cells
    walls = [block(x, bottom, cut(0.06, cells), 0.3) for x in (1 / 3, 2 / 3)]
    lefts = [edge, 1 / 3 + cut(0.06, cells), 2 / 3 + cut(0.06, cells)]
    columns = []
    for left, wet in zip(lefts, (0.0, 0.5, 1.0), strict=True):
        grit = matter("wet_sand", cohesion=2e3, saturation=wet, **SAND)
        columns.append(body(block(left, bottom, width, height), grit))
    scene = world(
        *columns, rough, *map(obstacle, walls), cells=cells, seconds=1.0, frame=0.05
    )
    record, checks = simulate(scene), []
    source = "Mohr-Coulomb, slope stability"
    for index, name in enumerate(("dry", "half wet", "flooded")):
        mean = record.x(index)[..., 1].mean(axis=1) - bottom
        left = float(mean[-1] / mean[0])
        stands = index == 1
        check = at_least if stands else at_most
        bound = 0.97 if stands else 0.75
        checks.append(check(f"{name}: height / first", left, bound, source))
    return Result(checks)


@case(coarse=48, fine=96)
def water_soaks_the_sand_that_it_reaches(cells: int) -> Result:
    """Water fills one side of a tank, damp sand the other."""
    edge = WALL / cells
    width, height = cut(0.25, cells), cut(0.2, cells)
    grit = matter("wet_sand", cohesion=2e3, saturation=0.2, **SAND)
    scene = world(
        body(block(edge, edge, width, height), grit),
        body(block(edge + width, edge, 1 - 2 * edge - width, height), matter("liquid")),
        cells=cells,
        seconds=1.0,
        frame=0.05,
    )
    record = simulate(scene, "saturation")
    wet, x = record.field("saturation", 0), record.x(0)[..., 0] - edge
    touching = x[0] > width - 1.0 / cells
    far = x[0] < 0.25 * width
    return Result(
        [
            at_least(
                "lowest change of saturation", np.diff(wet, axis=0).min(), 0, "soak"
            ),
            at_most("largest saturation", wet.max(), 1.0, "definition"),
            at_least("saturation next to water", wet[-1, touching].mean(), 0.8, "soak"),
            at_most("saturation far from it", wet[-1, far].mean(), 0.3, "soak"),
        ]
    )
