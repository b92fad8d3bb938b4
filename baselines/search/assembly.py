"""From what is seen to plain data of a scene."""

import copy
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.guess import Sight, Thing
from mpmworlds.baselines.search.matter import of_matter
from mpmworlds.baselines.search.perception.forms import polygons
from mpmworlds.baselines.search.perception.laws import Law, amplitude_of
from mpmworlds.baselines.search.prior import Prior
from mpmworlds.baselines.search.side import Told, over
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.sim.scene.sections import SCHEMA

Data = dict[str, Any]

UNSEEN: Final[Mapping[str, Data]] = {
    "box": {"size": [0.16, 0.08]},
    "capsule": {"length": 0.12, "radius": 0.04},
    "circle": {"radius": 0.08},
    "ellipse": {"semi_axes": [0.1, 0.06]},
    "fan_blades": {"blade_count": 3, "blade_length": 0.1, "thickness": 0.03},
    "polygon": {"vertices": [[-0.08, -0.05], [0.08, -0.05], [0.0, 0.1]]},
    "ring": {"radius": 0.08, "thickness": 0.03},
    "rounded_box": {"size": [0.16, 0.08], "corner_radius": 0.02},
}
"""Lengths of shapes that are told and not seen [m]."""
SUBSTEPS: Final = 32  # of a frame, until it is known how many are needed
CENTERED: Final = 0.012  # distance of a pivot from the center that is none [m]
CORNERS: Final = 24


def scene_data(
    sight: Sight, told: Told, form: VideoForm, prior: Prior, gravity: Any
) -> Data:
    """Plain data of the scene that is seen, with typical materials to be sought.

    Parameters
    ----------
    sight
        Things of the prefix.
    told
        What is known; it stays as it is.
    form
        Of the video.
    prior
        What is usual.
    gravity
        [m/s^2].
    """
    usual = prior.simulation
    frame = prior.frame_time / form.framerate
    simulation = {
        "grid_resolution": usual["grid_resolution"],
        "time_step_dt": float(f"{frame / SUBSTEPS:.9g}"),
        "substeps_per_frame": SUBSTEPS,
        "duration_frames": form.frames,
        "particles_per_cell": usual["particles_per_cell"],
        "seed": 0,
    }
    walls = {
        "contact": prior.walls[0]["contact"],
        "friction": prior.walls[0]["frictions"][0],
        "thickness_cells": usual["thickness_cells"],
    }
    environment = {"gravity": [float(v) for v in gravity], "walls": walls}
    # Things behind others first: what is told is in its order.
    things = [
        _object(thing, f"object_{number}", sight, told, prior)
        for number, thing in enumerate(sight.things)
    ]
    return {
        "schema": SCHEMA,
        "simulation": over(told.simulation, simulation)
        | {"duration_frames": form.frames},
        "environment": over(told.environment, environment),
        "objects": things,
        "output": {"resolution": form.pixels, "framerate": form.framerate},
    }


def _object(thing: Thing, name: str, sight: Sight, told: Told, prior: Prior) -> Data:
    color = thing.track.color if thing.track else ""
    found: Data = {
        "name": name,
        "object_type": thing.kind,
        "visualization": {"color": color},
    }
    if thing.fit is not None:
        found["shape"] = copy.deepcopy(thing.fit.shape)
    if thing.kind == "kinematic_collider":
        _move(found, thing, sight, prior)
    if thing.kind == "dynamic_body":
        found["initial_state"] = _initial(thing)
    if thing.kind == "emitter":
        _pour(found, thing, told, prior, sight)
    if thing.kind in ("dynamic_body", "emitter"):
        found = of_matter(found, _matter(thing.told, prior), thing.told)
    if "shape" not in found:  # told, but not seen
        x, y = told.near.get(str(thing.told.get("name")), (0.5, 0.5))
        kind = (thing.told.get("shape") or {}).get("type", "circle")
        found["shape"] = {"type": kind, "center": [x, y]} | UNSEEN[kind]
    if thing.kind in ("static_collider", "kinematic_collider"):
        found["contact"] = prior.contact_of(found)
    whole: Data = over(thing.told, found)
    if whole["shape"]["type"] != found["shape"]["type"]:
        whole["shape"] = {"center": found["shape"]["center"]} | whole["shape"]
    return whole


def _matter(told: Mapping[str, Any], prior: Prior) -> Data:
    known = (told.get("physics_properties") or {}).get("constitutive_model")
    likeliest = max(prior.materials, key=lambda name: prior.materials[name]["share"])
    return prior.typical(known or likeliest)


def _initial(thing: Thing) -> Data:
    flight = thing.flight
    if flight is None:
        return {"velocity": [0.0, 0.0], "angular_velocity": 0.0}
    round_ = thing.fit is not None and thing.fit.shape["type"] == "circle"
    return {
        "velocity": list(flight.velocity),
        "angular_velocity": 0.0 if round_ else flight.spin,
    }


def _move(found: Data, thing: Thing, sight: Sight, prior: Prior) -> None:
    """Give a collider its motion, and the pivot that it turns about."""
    told = thing.told.get("kinematics") or {}
    known = told.get("type")
    laws = [law for law in thing.laws if known in (None, law.kinematics["type"])]
    if not laws:
        found["kinematics"] = _unseen_motion(known)
        return
    law = laws[0]
    end = sight.frame_time * (len(sight.labels.numbers) - 1)
    found["kinematics"] = copy.deepcopy(law.kinematics)
    if law.kinematics["type"] == "translate" and "stop" not in law.kinematics:
        found["kinematics"]["stop"] = prior.stop(law.kinematics, end, 0.5)
    if "frequency" in told and thing.poses is not None:
        found["kinematics"]["amplitude"] = amplitude_of(
            thing.poses, sight.frame_time, told["frequency"], told["phase_deg"]
        )
    if "center" not in (thing.told.get("shape") or {}):
        _set_pivot(found, law, thing, sight)


def _unseen_motion(kind: str | None) -> Data:
    """A motion that is told, of a collider that is not seen to move."""
    if kind == "conveyor":
        return {"type": "conveyor", "surface_speed": 1.0}
    if kind == "rotate":
        return {"type": "rotate", "angular_velocity": 1.7, "start": 1.0}
    if kind == "translate":
        return {"type": "translate", "velocity": [0.1, 0.0], "start": 1.0, "stop": 2.0}
    return {
        "type": "oscillate",
        "amplitude": [0.03, 0.0],
        "frequency": 0.9,
        "phase_deg": 0.0,
        "start": 1.0,
    }


def _set_pivot(found: Data, law: Law, thing: Thing, sight: Sight) -> None:
    """A shape turns about its center: make the pivot the center."""
    shape, aside = found["shape"], np.array(law.pivot)
    if float(np.hypot(*aside)) < CENTERED:
        if law.kinematics["type"] == "rotate":
            return
    if not aside.any():
        return
    if shape["type"] != "polygon":
        if float(np.hypot(*aside)) < CENTERED or thing.track is None:
            return
        mask = thing.track.masks[0]
        starts = list(polygons(mask, sight.pixels, CORNERS))
        if not starts:
            return
        last = starts[-1]
        shape = found["shape"] = last.build(last.numbers)
        aside = aside + np.array(thing.fit.shape["center"]) - shape["center"]  # type: ignore[union-attr]
    shape["vertices"] = (np.array(shape["vertices"]) - aside).tolist()
    shape["center"] = (np.array(shape["center"]) + aside).tolist()


def _pour(found: Data, thing: Thing, told: Told, prior: Prior, sight: Sight) -> None:
    """Give an emitter its nozzle."""
    if thing.nozzles:
        nozzle = thing.nozzles[0]
        found["shape"] = copy.deepcopy(nozzle.shape)
        found["emission"] = copy.deepcopy(nozzle.emission)
    else:  # it starts later
        end = sight.frame_time * len(sight.labels.numbers)
        x, y = told.near.get(str(thing.told.get("name")), (0.5, 0.75))
        kind = (thing.told.get("emission") or {}).get("type", "jet")
        more = {
            "rain": {"drop_radius": 0.03},
            "hose": {"swing_deg": 20.0, "period": 1.0},
        }
        found["shape"] = {
            "type": "box",
            "center": [x, y],
            "angle_deg": 0.0,
            "size": [0.08, 0.04],
        }
        found["emission"] = {
            "type": kind,
            "rate": 1500.0,
            "velocity": [0.0, -1.0],
            "start": end + 0.3,
        } | more.get(kind, {})
    emission = found["emission"]
    emission["stop"] = max(
        prior.emission_stops[emission["type"]][1], emission["start"] + 0.5
    )
