"""Liquid: pressure and volume at rest, dam breaks, viscous films."""

import numpy as np
from benchmarks.physics.case import (
    Curve,
    Floats,
    Plot,
    Result,
    at_most,
    case,
    near,
)
from benchmarks.physics.world import (
    WALL,
    G,
    Record,
    block,
    body,
    cut,
    matter,
    simulate,
    world,
)

MOYCE = "Martin & Moyce 1952"
BULK = 4e5  # modulus of the usual liquid [Pa]
FRONTS = {  # width squared over height: T = n t sqrt(g / a), front Z = z / a
    2: (
        [0.41, 0.84, 1.19, 1.43, 1.63, 1.83, 1.98, 2.20, 2.32, 2.51, 2.65, 2.83, 2.97],
        [1.11, 1.22, 1.44, 1.67, 1.89, 2.11, 2.33, 2.56, 2.78, 3.00, 3.22, 3.44, 3.67],
    ),
    1: (
        [0.62, 0.80, 1.02, 1.19, 1.34, 1.50, 1.66, 1.81, 1.97],
        [1.22, 1.44, 1.67, 1.89, 2.11, 2.33, 2.56, 2.78, 3.00],
    ),
}
HEIGHTS = {  # t sqrt(g / a), height of the column over that at the start
    2: (
        [0.56, 0.77, 0.93, 1.08, 1.28, 1.46, 1.66, 1.84, 2.00, 2.21, 2.45, 2.70],
        [0.94, 0.89, 0.83, 0.78, 0.72, 0.67, 0.61, 0.56, 0.50, 0.44, 0.39, 0.33],
    ),
    1: ([0.80, 1.29, 1.74, 2.15], [0.89, 0.78, 0.67, 0.56]),
}


def pool_at_rest(cells: int) -> tuple[Record, float, float]:
    """States of a pool as wide as the domain for 10 s, its floor and height [m]."""
    edge, height = WALL / cells, cut(0.4, cells)
    pool = body(block(edge, edge, 1.0 - 2 * edge, height), matter("liquid"))
    scene = world(pool, cells=cells, seconds=10.0, frame=0.1)
    return simulate(scene, "J"), edge, height


@case(coarse=32, fine=64)
def liquid_at_rest_keeps_its_volume(cells: int) -> Result:
    """A pool as wide as the domain, 10 s."""
    record, edge, height = pool_at_rest(cells)
    full = 2.0 * (record.x(0)[..., 1].mean(axis=1) - edge)  # of a level pool
    sag = 1e3 * G * height / BULK / 3  # by its own weight
    speed = np.hypot(*record.v(0)[-1].T)
    checks = [
        near("height after 10 s [m]", full[-1], height * (1 - sag), 0.03, "volume"),
        at_most("mean speed after 10 s [m/s]", speed.mean(), 0.01, "rest"),
    ]
    curves = [
        Curve("simulated", record.time, full),
        Curve("at first", record.time[[0, -1]], full[[0, 0]], reference=True),
    ]
    return Result(checks, [Plot("Pool at rest", "t [s]", "height [m]", curves)])


@case(coarse=32, fine=64)
def liquid_at_rest_has_hydrostatic_pressure(cells: int) -> Result:
    """p = K (1 - J) = rho g depth after 10 s."""
    record, edge, height = pool_at_rest(cells)
    y, pressure = record.x(0)[-1, :, 1], BULK * (1.0 - record.field("J", 0)[-1]).clip(0)
    depth = edge + height - y
    rows = np.floor(depth * cells).astype(int)
    inner = (rows >= 2) & (rows < rows.max() - 1)
    slope = np.polyfit(depth[inner], pressure[inner], 1)[0]
    profile = [
        (depth[rows == row].mean(), pressure[rows == row].mean()) for row in set(rows)
    ]
    profile.sort()
    off = max(abs(p - 1e3 * G * h) for h, p in profile) / (1e3 * G * height)
    source = "hydrostatics"
    checks = [
        near("slope of pressure [Pa/m]", slope, 1e3 * G, 0.05, source),
        at_most("largest error of a row of cells / p at bottom", off, 0.1, source),
    ]
    depths, pressures = np.array(profile).T
    curves = [
        Curve("simulated", pressures, depths),
        Curve("rho g depth", 1e3 * G * depths, depths, reference=True),
    ]
    axes = "p [Pa]", "depth [m]"
    return Result(checks, [Plot("Hydrostatic pressure", *axes, curves)])


def dam(cells: int, squared: int) -> Result:
    """Collapse of a column of liquid of width a and height n^2 a."""
    edge, a = WALL / cells, cut({2: 0.2, 1: 0.25}[squared], cells)
    column = body(block(edge, edge, a, squared * a), matter("liquid"))
    lasts = 0.9 * np.sqrt(a / G) * {2: 2.4, 1: 2.3}[squared]
    record = simulate(world(column, cells=cells, seconds=lasts, frame=lasts / 60))
    x = record.x(0)
    n, scaled = squared**0.5, record.time * np.sqrt(G / a)
    low = x[..., 1] < edge + 2.0 / cells
    front = np.where(low, x[..., 0], 0.0).max(axis=1) - edge + 0.25 / cells
    left = x[..., 0] < edge + 2.0 / cells
    top = np.where(left, x[..., 1], 0.0).max(axis=1) - edge + 0.25 / cells
    checks, plots = [], []
    for what, table, T, found in (
        ("front Z(T)", FRONTS, n * scaled, front / a),
        ("height H(T)", HEIGHTS, scaled, top / (squared * a)),
    ):
        times, values = map(np.array, table[squared])
        seen = times <= T[-1]
        off = np.interp(times[seen], T, found) / values[seen] - 1.0
        tolerance = 0.15 if what[0] == "f" else 0.1
        mean, most = np.sqrt((off**2).mean()), abs(off).max()
        checks += [
            at_most(f"n2 = {squared}: {what}, rms part off", mean, tolerance, MOYCE),
            at_most(f"n2 = {squared}: {what}, most off", most, 2 * tolerance, MOYCE),
        ]
        curves = [
            Curve("simulated", T, found),
            Curve(MOYCE, times, values, reference=True),
        ]
        letter = what.split()[1][0]
        plots.append(Plot(f"Dam break, n2 = {squared}: {letter}", "T", letter, curves))
    return Result(checks, plots)


@case(coarse=48, fine=128)
def a_dam_of_double_height_breaks_as_in_experiments(cells: int) -> Result:
    """Column of aspect ratio 2."""
    return dam(cells, 2)


@case(coarse=48, fine=128)
def a_square_dam_breaks_as_in_experiments(cells: int) -> Result:
    """Column of aspect ratio 1."""
    return dam(cells, 1)


@case(coarse=32, fine=64)
def liquid_keeps_its_volume_when_it_splashes(cells: int) -> Result:
    """A column collapses and sloshes until it is level."""
    edge, width, height = WALL / cells, cut(0.3, cells), cut(0.6, cells)
    column = body(block(edge, edge, width, height), matter("liquid"))
    record = simulate(world(column, cells=cells, seconds=10.0, frame=0.1))
    level = width * height / (1.0 - 2 * edge)
    full = 2.0 * (record.x(0)[..., 1].mean(axis=1) - edge)
    energy = 0.5 * (record.v(0) ** 2).sum(axis=2).mean(axis=1)
    energy += G * (record.x(0)[..., 1].mean(axis=1) - edge)
    checks = [
        near("height of the pool after 10 s [m]", full[-1], level, 0.03, "volume"),
        at_most("energy / first", (energy / energy[0]).max(), 1.01, "no work done"),
    ]
    curves = [
        Curve("simulated", record.time, full),
        Curve("level", record.time[[0, -1]], [level, level], reference=True),
    ]
    plot = Plot("Twice the height of the center of mass", "t [s]", "h [m]", curves)
    return Result(checks, [plot])


@case(coarse=96, fine=192)
def a_viscous_film_flows_down_as_nusselt_says(cells: int) -> Result:
    """A layer h on a sticky floor, driven along it: u(y, t) by its Fourier series."""
    nu, along, h, edge = 0.05, 1.0, cut(0.075, cells), WALL / cells
    syrup = matter("liquid", viscosity=nu * 1e3)
    film = body(block(edge, edge, 1 - 2 * edge, h), syrup)
    scene = world(film, cells=cells, seconds=0.4, gravity=(along, -2.0), walls="sticky")
    record = simulate(scene)
    x, u = record.x(0)[-1], record.v(0)[-1, :, 0]
    middle = abs(x[:, 0] - 0.4) < 0.08
    y = x[middle, 1] - edge
    expected = film_profile(y, record.time[-1], h, nu, along)
    rows = np.floor(y * cells).astype(int)
    means = np.array(
        [
            [part[rows == row].mean() for part in (y, u[middle], expected)]
            for row in sorted(set(rows))
        ]
    )
    most = along * h**2 / (2 * nu)
    source = "Nusselt film, started from rest"
    off = abs(means[:, 1] - means[:, 2]).max() / most
    checks = [
        near("surface speed [m/s]", means[-1, 1], means[-1, 2], 0.06, source),
        at_most("largest error / surface speed", off, 0.06, source),
    ]
    curves = [
        Curve("simulated", means[:, 1], means[:, 0] / h),
        Curve(source, means[:, 2], means[:, 0] / h, reference=True),
    ]
    return Result(checks, [Plot("Viscous film", "u [m/s]", "y / h", curves)])


def film_profile(y: Floats, t: float, h: float, nu: float, along: float) -> Floats:
    """Speed [m/s] at heights y of a film h [m] that starts at rest."""
    n = np.arange(40)[:, None] + 0.5
    modes = 2.0 * along * h**2 / (nu * (n * np.pi) ** 3)
    decay = np.exp(-nu * (n * np.pi / h) ** 2 * t)
    profile: Floats = (modes * (1.0 - decay) * np.sin(n * np.pi * y / h)).sum(axis=0)
    return profile
