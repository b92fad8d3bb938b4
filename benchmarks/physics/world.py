"""Scenes of cases, and the states that their programs go through."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from benchmarks.physics.case import Floats

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import RunError, run
from mpmworlds.sim.run.states import States
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import fastest_step

G = 9.8  # m/s^2
WALL = 3  # cells
LOOK = {"visualization": {"color": "#2C90F5"}}
TIMEOUT = 1200.0  # seconds
WIDTHS = {"J": 1, "saturation": 1, "C": 4, "F": 4}  # of fields of particles
PACK = '''

def frames(pictures=frames):
    """Yield the bytes of fields in the place of pictures."""
    for _ in pictures():
        numbers = [field.to_numpy().ravel() for field in ({names},)]
        data = np.concatenate(numbers).astype(np.float32).view(np.uint8)
        yield np.pad(data, (0, -len(data) % 3)).reshape(1, -1, 3)
'''


def box(center: tuple[float, float], *size: float, angle: float = 0.0) -> Any:
    """Rectangle of a width and height [m]."""
    angle_deg = float(angle)
    return {"type": "box", "center": center, "size": size, "angle_deg": angle_deg}


def block(left: float, bottom: float, width: float, height: float) -> Any:
    """Rectangle by its lower left corner and its size [m]."""
    return box((left + 0.5 * width, bottom + 0.5 * height), width, height)


def disc(center: tuple[float, float], radius: float) -> Any:
    """Disc [m]."""
    return {"type": "circle", "center": center, "radius": radius}


def matter(model: str, density: float = 1000.0, **properties: float) -> Any:
    """Material of a density [kg/m^2]."""
    usual: dict[str, float] = {}
    if model == "liquid":
        usual = {"bulk_modulus": 4e5}
    elif model != "rigid":
        usual = {"youngs_modulus": 4e5, "poissons_ratio": 0.3}
    return {"constitutive_model": model, "density": density} | usual | properties


def body(
    shape: Any,
    physics: Any,
    velocity: tuple[float, float] = (0.0, 0.0),
    spin: float = 0.0,
) -> Any:
    """Body that starts with a velocity [m/s] and a spin [rad/s]."""
    state = {"velocity": velocity, "angular_velocity": spin}
    return LOOK | {
        "object_type": "dynamic_body",
        "shape": shape,
        "physics_properties": physics,
        "initial_state": state,
    }


def obstacle(shape: Any, law: str = "separate", friction: float = 0.0) -> Any:
    """Collider that never moves."""
    touch = {"type": law, "friction": friction}
    return LOOK | {"object_type": "static_collider", "shape": shape, "contact": touch}


def machine(
    shape: Any, kinematics: Any, law: str = "separate", friction: float = 0.0
) -> Any:
    """Collider with a prescribed motion."""
    touch = {"type": law, "friction": friction}
    return LOOK | {
        "object_type": "kinematic_collider",
        "shape": shape,
        "kinematics": kinematics,
        "contact": touch,
    }


def nozzle(shape: Any, emission: Any, physics: Any = None) -> Any:
    """Emitter, of liquid unless another material is given."""
    return LOOK | {
        "object_type": "emitter",
        "shape": shape,
        "physics_properties": physics or matter("liquid"),
        "emission": emission,
    }


def world(
    *things: Any,
    cells: int,
    seconds: float,
    frame: float = 0.01,
    gravity: tuple[float, float] = (0.0, -G),
    walls: str = "separate",
    substeps: int | None = None,
) -> Scene:
    """Scene of things named object_0 and so on, with a stable time step.

    Parameters
    ----------
    things : mappings
        Objects without a name.
    cells : int
        Per side.
    seconds, frame : float
        Length of the simulation and between states [s].
    gravity : (float, float)
        Acceleration [m/s^2].
    walls : str
        Contact law of the walls.
    substeps : int, optional
        Per frame; if not given, 0.9 of the largest stable step is taken.
    """
    objects = [thing | {"name": f"object_{i}"} for i, thing in enumerate(things)]

    def made(steps: int) -> Scene:
        simulation = {
            "grid_resolution": cells,
            "time_step_dt": frame / steps,
            "substeps_per_frame": steps,
            "duration_frames": round(seconds / frame) + 1,
            "particles_per_cell": 4,
            "seed": 3,
        }
        contact = {"contact": walls, "thickness_cells": WALL}
        return Scene.from_data(
            {
                "schema": "mpmworlds-scene/1",
                "simulation": simulation,
                "environment": {"gravity": list(gravity), "walls": contact},
                "objects": objects,
                "output": {"resolution": 32, "framerate": 30},
            }
        )

    if substeps is None:
        bound, _ = fastest_step(made(math.ceil(frame / 1e-5)))
        substeps = math.ceil(frame / (0.9 * bound))
    return made(substeps)


@dataclass(frozen=True, eq=False)
class Record:
    """States of a run, and fields of its particles (T, N) or (T, N, 2, 2)."""

    states: States
    fields: dict[str, Floats]

    @property
    def time(self) -> Floats:
        """Times of the frames [s]."""
        return self.states.time

    def x(self, index: int) -> Floats:
        """Positions [m] of the particles of an object, (T, n, 2)."""
        return self.states.positions[:, self._of(index)].astype(np.float64)

    def v(self, index: int) -> Floats:
        """Velocities [m/s] of the particles of an object, (T, n, 2)."""
        return self.states.velocities[:, self._of(index)].astype(np.float64)

    def mass(self, index: int) -> Floats:
        """Masses [kg] of the particles of an object, (n,)."""
        return self.states.mass[self._of(index)].astype(np.float64)

    def field(self, name: str, index: int) -> Floats:
        """Values of a field at particles of an object, (T, n) or (T, n, 2, 2)."""
        return self.fields[name][:, self._of(index)]

    def pose(self, index: int) -> Floats:
        """Centers [m] and angles [rad] of a solid, (T, 3)."""
        return self.states.poses[:, self._solid(index)]

    def rate(self, index: int) -> Floats:
        """Velocities [m/s] and spins [rad/s] of a solid, (T, 3)."""
        return self.states.rates[:, self._solid(index)]

    def _of(self, index: int) -> npt.NDArray[np.bool_]:
        return np.equal(self.states.object_id, index)

    def _solid(self, index: int) -> int:
        return int(np.flatnonzero(self.states.solid_id == index)[0])


def simulate(scene: Scene, *names: str) -> Record:
    """Run the program of a scene in its own process.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    names : str
        Fields of particles to read besides positions and velocities.

    Raises
    ------
    RunError
        If it does not end well.
    """
    text = link(scene)
    if names:
        text += PACK.format(names=", ".join(names))
    outcome = run(text, timeout=TIMEOUT, states=True, trusted=True)
    pictures = outcome.expect()
    if outcome.states is None:
        raise RunError("the program ended without states")
    states = States.of(scene, outcome.states)
    count = len(states.object_id)
    fields = {}
    if names:
        widths = [WIDTHS[name] for name in names]
        data = pictures.reshape(len(pictures), -1)[:, : 4 * count * sum(widths)]
        numbers = np.ascontiguousarray(data).view(np.float32).astype(np.float64)
        columns = np.split(numbers, count * np.cumsum(widths)[:-1], axis=1)
        for name, width, column in zip(names, widths, columns, strict=True):
            shape = (len(pictures), count) + ((2, 2) if width == 4 else ())
            fields[name] = column.reshape(shape)
    return Record(states, fields)


def cut(value: float, cells: int) -> float:
    """A length [m] as the nearest whole number of cells."""
    return round(value * cells) / cells


def square_law(time: Floats, place: Floats) -> float:
    """Acceleration [m/s^2] of places (T,) [m]: twice the leading coefficient."""
    return 2.0 * float(np.polyfit(time, place, 2)[0])
