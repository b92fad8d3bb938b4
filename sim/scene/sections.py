"""The sections of a scene file, each field valid by itself."""

from typing import Literal

from mpmworlds.sim.scene.fields import Part, Vec2, about
from mpmworlds.sim.scene.objects import AnyObject, Law

SCHEMA = "mpmworlds-scene/1"
MOST_OBJECTS = 64


class Simulation(Part):
    """Resolution and length of the simulation."""

    grid_resolution: int = about(
        "neutral", "cells per side", ge=32, le=512, kind="setting"
    )
    time_step_dt: float = about(
        "derived", "time step", "s", gt=0.0, le=1e-2, kind="setting"
    )
    substeps_per_frame: int = about(
        "derived", "time steps per frame", ge=1, le=10000, kind="setting"
    )
    duration_frames: int = about(
        "neutral", "frames of the video", ge=1, le=10000, kind="setting"
    )
    particles_per_cell: int = about(
        "neutral", "particles per cell", ge=1, le=16, kind="setting"
    )
    seed: int = about(
        "neutral", "seed of the initial jitter", ge=0, lt=2**63, kind="setting"
    )


class Walls(Part):
    """The four walls of the domain."""

    contact: Law = about("neutral", "contact law", default="separate")
    friction: float = about(
        "neutral", "Coulomb coefficient", default=0.0, ge=0, le=10, kind="friction"
    )
    thickness_cells: int = about(
        "neutral", "thickness", "cells", default=3, ge=3, le=32, kind="setting"
    )


class Environment(Part):
    """What surrounds the objects."""

    gravity: Vec2 = about(
        "neutral", "gravity", "m/s^2", default=(0.0, -9.8), kind="acceleration"
    )
    walls: Walls = about("neutral", "walls of the domain", default=Walls())


class Output(Part):
    """The video."""

    resolution: int = about(
        "neutral", "pixels per side, even", ge=32, le=1024, kind="setting"
    )
    framerate: int = about("neutral", "frames per second", ge=1, le=120, kind="setting")


class Sections(Part):
    """All sections together; what holds between them is not checked."""

    schema_: Literal["mpmworlds-scene/1"] = about(
        "neutral", "schema of this file", alias="schema"
    )
    simulation: Simulation = about("neutral", "resolution and length")
    environment: Environment = about("neutral", "surroundings", default=Environment())
    objects: tuple[AnyObject, ...] = about(
        "neutral", "objects", min_length=1, max_length=MOST_OBJECTS
    )
    output: Output = about("neutral", "video")
