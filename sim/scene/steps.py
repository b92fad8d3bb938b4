"""Time steps of scenes: how long a frame is, and how few steps it takes."""

import math
from typing import Any, TypeVar

from mpmworlds.sim.program.features.material import Material
from mpmworlds.sim.scene.objects import DynamicBody, Emitter
from mpmworlds.sim.scene.sections import Sections

COURANT = 0.85  # largest fraction of a cell that a wave in moving matter crosses a step
DIFFUSION = 1 / 8  # of a squared cell per step; then no gradient of velocity overshoots
CONTACT = 5e-4  # longest step in which rigid bodies meet [s]
ROUNDED = 1e-8  # relative error that is forgiven to a step of nine digits
FINE = 10_000  # steps of a frame that are enough for any scene of the schema
S = TypeVar("S", bound=Sections)


def frame_time(scene: Sections) -> float:
    """Simulated time between two frames [s], rounded to where it is a short number."""
    simulation = scene.simulation
    return float(f"{simulation.time_step_dt * simulation.substeps_per_frame:.9g}")


def spacing(scene: Sections) -> float:
    """Distance between particles at rest [m]."""
    sim = scene.simulation
    return 1.0 / sim.grid_resolution / math.sqrt(sim.particles_per_cell)


def fastest_step(scene: Sections) -> tuple[float, str]:
    """Largest stable time step [s] and the object that sets it.

    Waves cross at most `COURANT` cells in a step, in matter that moves as fast as what
    is the fastest of all would after a fall through the whole domain; explicit
    viscosity spreads momentum over at most `DIFFUSION` squared cells; and rigid bodies
    meet in steps of at most `CONTACT`.
    """
    dx = 1.0 / scene.simulation.grid_resolution
    fall = math.sqrt(2.0 * math.hypot(*scene.environment.gravity))
    speed = math.hypot(fall, max(speed_of(thing) for thing in scene.objects))
    return min(
        (_step(thing.physics_properties, speed, dx), thing.name)
        for thing in scene.objects
        if isinstance(thing, DynamicBody | Emitter)
    )


def _step(material: Material, speed: float, dx: float) -> float:
    """Largest stable time step [s] of a material that moves in cells of size dx [m]."""
    wave, viscosity = material.wave_speed(), material.kinematic_viscosity()
    return min(
        COURANT * dx / (wave + speed),
        DIFFUSION * dx**2 / viscosity if viscosity else math.inf,
        math.inf if wave else CONTACT,
    )


def speed_of(thing: Any) -> float:
    """Fastest prescribed speed of an object [m/s]."""
    if thing.object_type == "emitter":
        return math.hypot(*thing.emission.velocity)
    if thing.object_type == "static_collider":
        return 0.0
    reach: float = thing.shape.reach()
    if thing.object_type == "dynamic_body":
        state = thing.initial_state
        return math.hypot(*state.velocity) + abs(float(state.angular_velocity)) * reach
    fastest: float = thing.kinematics.fastest(reach)
    return fastest


def steps_of(scene: Sections, substeps: int) -> dict[str, Any]:
    """Plain data of so many steps of a frame, which lasts as long as before."""
    dt = float(f"{frame_time(scene) / substeps:.9g}")
    return {"substeps_per_frame": substeps, "time_step_dt": dt}


def with_fewest_steps(scene: S) -> S:
    """A copy with the longest stable time step that divides a frame."""
    bound, _ = fastest_step(scene)
    substeps = math.ceil(frame_time(scene) / bound * (1.0 - ROUNDED))
    simulation = scene.simulation.model_copy(update=steps_of(scene, substeps))
    return scene.model_copy(update={"simulation": simulation})
