"""Free motion: flight, conservation and energy."""

import numpy as np
from benchmarks.physics.case import Curve, Floats, Plot, Result, at_most, case, near
from benchmarks.physics.world import G, Record, body, box, matter, simulate, world


@case(coarse=32, fine=64)
def free_flight_is_exact_to_the_order_of_the_scheme(cells: int) -> Result:
    """Bodies thrown up follow symplectic Euler: y = v t - g t (t + dt) / 2."""
    checks, misses = [], {}
    for steps in (25, 50):
        scene = world(
            body(box((0.25, 0.5), 0.12, 0.12), matter("elastic"), (0.5, 1.0), 3.0),
            body(box((0.6, 0.5), 0.12, 0.12), matter("rigid"), (0.5, 1.0), 3.0),
            cells=cells,
            seconds=0.3,
            substeps=steps,
        )
        record = simulate(scene)
        dt, t = scene.simulation.time_step_dt, record.time
        speed = record.v(0)[0].mean(axis=0)
        matter_y = record.x(0).mean(axis=1)
        solid = record.pose(1)
        for name, place, start in (
            ("elastic", matter_y, speed),
            ("rigid", solid[:, :2], np.array([0.5, 1.0])),
        ):
            y = place[:, 1] - place[0, 1] - start[1] * t
            misses[name, steps] = y[-1] + 0.5 * G * t[-1] ** 2
            scheme = abs(y + 0.5 * G * t * (t + dt)).max()
            drift = abs(place[:, 0] - place[0, 0] - start[0] * t).max()
            if steps == 50:
                source = "symplectic Euler"
                checks += [
                    at_most(f"{name}: off the scheme [m]", scheme, 1e-5, source),
                    at_most(f"{name}: off straight in x [m]", drift, 5e-5, "inertia"),
                ]
    for name in ("elastic", "rigid"):
        ratio = misses[name, 25] / misses[name, 50]
        checks.append(
            near(f"{name}: error at dt / error at dt/2", ratio, 2.0, 0.02, "order 1")
        )
    return Result(checks)


@case(coarse=32, fine=64)
def a_spinning_elastic_body_keeps_momentum_and_energy(cells: int) -> Result:
    """Let go of in rotation, bodies stretch and vibrate; nothing outside acts."""
    spin, size = 20.0, 0.18
    soft = {"youngs_modulus": 1e5}
    scene = world(
        body(box((0.3, 0.5), size, size), matter("elastic", **soft), spin=spin),
        body(box((0.7, 0.5), size, size), matter("elastic_fem", **soft), spin=spin),
        cells=cells,
        seconds=1.0,
        gravity=(0.0, 0.0),
    )
    record = simulate(scene, "C", "F")
    checks, curves = [], []
    for index, name in enumerate(("elastic", "elastic_fem")):
        momentum = np.average(record.v(index), 1, record.mass(index))
        drift = np.hypot(*(momentum - momentum[0]).T).max() / (spin * size / 2)
        turning = angular_momentum(record, index, 0.5 / cells)
        lost = abs(turning / turning[0] - 1.0).max()
        source = "conservation"
        checks += [
            at_most(f"{name}: momentum / rim speed", drift, 1e-5, source),
            at_most(f"{name}: change of angular momentum", lost, 1e-4, source),
        ]
    kinetic, strain = energies(record, 0, 0.5 / cells, 1e5, 0.3)
    total = (kinetic + strain) / kinetic[0]
    checks.append(
        at_most("elastic: largest energy / first", total.max(), 1.01, "no work done")
    )
    for label, part in (("kinetic", kinetic), ("strain", strain)):
        curves.append(Curve(label, record.time, part / kinetic[0]))
    curves.append(Curve("total", record.time, total))
    return Result(
        checks, [Plot("Energy of a spinning body", "t [s]", "E / E0", curves)]
    )


def angular_momentum(record: Record, index: int, half: float) -> Floats:
    """That of particles and of their affine motion, per mass, (T,) [m^2/s].

    `half` is half of a cell [m]: APIC gives a particle the inertia half^2 per axis.
    """
    x, v, C = record.x(index), record.v(index), record.field("C", index)
    arm = x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]
    spin = C[..., 1, 0] - C[..., 0, 1]
    total: Floats = np.average(arm + half**2 * spin, 1, record.mass(index))
    return total


def energies(
    record: Record, index: int, half: float, E: float, nu: float
) -> tuple[Floats, Floats]:
    """Kinetic and strain energy per particle of an elastic body, (T,) [m^2/s^2].

    Of density 1000 kg/m^2; fixed corotated, psi = mu |F - R|^2 + lam (J - 1)^2 / 2.
    """
    mu = 0.5 * E / (1.0 + nu) / 1000.0
    lam = 2.0 * mu * nu / (1.0 - 2.0 * nu)
    v, C = record.v(index), record.field("C", index)
    kinetic = 0.5 * ((v**2).sum(axis=2) + half**2 * (C**2).sum(axis=(2, 3)))
    s = np.linalg.svd(record.field("F", index), compute_uv=False)
    J = s[..., 0] * s[..., 1]
    strain = mu * ((s - 1.0) ** 2).sum(axis=2) + 0.5 * lam * (J - 1.0) ** 2
    return kinetic.mean(axis=1), strain.mean(axis=1)
