"""Small known scenes, and the prefixes that they draw."""

import copy
from functools import cache

import yaml

from mpmworlds.baselines.filling import scene_of
from mpmworlds.baselines.search.prior import prior
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import SCHEMA, Scene

FORM = VideoForm(300, 30, 512)
FRAME = 0.02  # simulated time between frames of a prefix [s]
FRAMES = 38

THINGS = """
still:
  object_type: static_collider
  shape: {type: ellipse, center: [0.2, 0.15], angle_deg: 20.0, semi_axes: [0.09, 0.05]}
wall:
  object_type: static_collider
  shape:
    type: polygon
    center: [0.9, 0.4]
    vertices: [[-0.04, -0.1], [0.04, -0.1], [0.04, 0.1]]
fan:
  object_type: kinematic_collider
  shape:
    {type: fan_blades, center: [0.55, 0.3], angle_deg: 10.0, blade_count: 3,
     blade_length: 0.1, thickness: 0.025}
  kinematics: {type: rotate, angular_velocity: -4.0}
gate:
  object_type: kinematic_collider
  shape: {type: box, center: [0.12, 0.5], size: [0.03, 0.2]}
  kinematics: {type: translate, velocity: [0.0, 0.35], start: 0.2, stop: 0.6}
bowl:
  object_type: kinematic_collider
  shape:
    {type: ring, center: [0.8, 0.8], radius: 0.08, thickness: 0.03, opening_deg: 120.0}
  kinematics:
    {type: oscillate, amplitude: [0.03, 0.0], amplitude_deg: 20.0, frequency: 2.0,
     phase_deg: 90.0}
brick:
  object_type: dynamic_body
  shape: {type: box, center: [0.4, 0.75], angle_deg: 15.0, size: [0.14, 0.1]}
  physics_properties: {constitutive_model: elastic}
  initial_state: {velocity: [0.3, 0.6], angular_velocity: 2.0}
ball:
  object_type: dynamic_body
  shape: {type: circle, center: [0.3, 0.55], radius: 0.07}
  physics_properties: {constitutive_model: snow}
jet:
  object_type: emitter
  shape: {type: box, center: [0.15, 0.8], angle_deg: -90.0, size: [0.05, 0.05]}
  physics_properties: {constitutive_model: liquid}
  emission: {type: jet, rate: 4000.0, velocity: [1.5, 0.0], start: 0.06, stop: 2.5}
rain:
  object_type: emitter
  shape: {type: box, center: [0.6, 0.85], angle_deg: 0.0, size: [0.3, 0.05]}
  physics_properties: {constitutive_model: elastic}
  emission:
    {type: rain, rate: 4000.0, velocity: [0.0, -1.0], drop_radius: 0.025, stop: 2.5}
"""
COLORS = ("#F52D2C", "#F4912C", "#F5F42C", "#2CF52D", "#2CF4F4", "#2C5FF4", "#C32CF5")


def world(*names, gravity=(0.0, -9.8), cells=128, form=FORM):
    """A valid scene of some of the things."""
    things = yaml.safe_load(THINGS)
    objects = []
    for number, name in enumerate(names):
        thing = {"name": f"object_{number}"} | copy.deepcopy(things[name])
        thing["visualization"] = {"color": COLORS[number]}
        if "physics_properties" in thing:
            known = thing["physics_properties"]["constitutive_model"]
            thing["physics_properties"] = prior().typical(known)
        objects.append(thing)
    return checked(
        {
            "schema": SCHEMA,
            "simulation": {
                "grid_resolution": cells,
                "time_step_dt": 0.3 / form.framerate / 32,
                "substeps_per_frame": 32,
                "duration_frames": form.frames,
                "particles_per_cell": 4,
                "seed": 5,
            },
            "environment": {
                "gravity": list(gravity),
                "walls": {"contact": "separate", "friction": 0.2, "thickness_cells": 6},
            },
            "objects": objects,
            "output": {"resolution": form.pixels, "framerate": form.framerate},
        }
    )


def checked(data):
    """The valid scene of plain data."""
    return Scene.from_yaml(scene_of(data).text)


def prefix_of(scene):
    """The prefix that a scene draws, as it is evaluated."""
    return _prefix_of(scene.to_yaml())


@cache
def _prefix_of(text):
    scene = Scene.from_yaml(text)
    every = scene.output.framerate // 15
    frames = run(link(scene), (FRAMES - 1) * every + 1, trusted=True).expect()
    return reduce_clip(frames, scene.output.framerate)
