"""Scenes that tests share: one with every kind of object, and random valid ones."""

import copy
from functools import cache

from hypothesis import strategies as st

from mpmworlds.builder.plan.candidates import editable
from mpmworlds.builder.recipes.compose import compose, draw_counts
from mpmworlds.builder.recipes.modify import modify
from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.recipes.perturb import perturb
from mpmworlds.builder.recipes.streams import stream
from mpmworlds.builder.recipes.tables import first_tables
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.steps import with_fewest_steps

MANY = 44  # random scenes in all

ELASTIC = {
    "constitutive_model": "elastic",
    "density": 1000.0,
    "youngs_modulus": 2.0e5,
    "poissons_ratio": 0.3,
}
LIQUID = {
    "constitutive_model": "liquid",
    "density": 1000.0,
    "bulk_modulus": 4.0e5,
    "viscosity": 0.05,
}
SNOW = {
    "constitutive_model": "snow",
    "density": 400.0,
    "youngs_modulus": 6.0e4,
    "poissons_ratio": 0.2,
}
SAND = {
    "constitutive_model": "sand",
    "density": 1600.0,
    "youngs_modulus": 5.0e5,
    "poissons_ratio": 0.25,
    "friction_angle_deg": 35.0,
}

MESH = ELASTIC | {"constitutive_model": "elastic_fem"}
RIGID = {"constitutive_model": "rigid", "density": 800.0}
PLASTIC = ELASTIC | {"constitutive_model": "plastic", "yield_stress": 5.0e3}
WET_SAND = SAND | {"constitutive_model": "wet_sand", "cohesion": 2.0e3}
PASTE = ELASTIC | {
    "constitutive_model": "viscoplastic",
    "yield_stress": 100.0,
    "consistency": 10.0,
}
SLIME = ELASTIC | {"constitutive_model": "viscoelastic", "relaxation_time": 0.1}

BODY = {
    "name": "object_0",
    "object_type": "dynamic_body",
    "shape": {"type": "box", "center": [0.25, 0.7], "size": [0.2, 0.16]},
    "physics_properties": ELASTIC,
    "initial_state": {"velocity": [0.0, 0.0], "angular_velocity": 0.0},
    "visualization": {"color": "#F52D2C"},
}
OBSTACLE = {
    "name": "object_1",
    "object_type": "static_collider",
    "shape": {
        "type": "polygon",
        "center": [0.25, 0.25],
        "vertices": [[-0.15, -0.1], [0.15, -0.1], [0.0, 0.12]],
    },
    "visualization": {"color": "#969696"},
}
FAN = {
    "name": "object_2",
    "object_type": "kinematic_collider",
    "shape": {
        "type": "fan_blades",
        "center": [0.7, 0.35],
        "blade_count": 3,
        "blade_length": 0.15,
        "thickness": 0.04,
    },
    "kinematics": {"type": "rotate", "angular_velocity": 4.0},
    "visualization": {"color": "#F5F42C"},
}
GATE = {
    "name": "object_2",
    "object_type": "kinematic_collider",
    "shape": {"type": "box", "center": [0.7, 0.35], "size": [0.06, 0.3]},
    "kinematics": {
        "type": "translate",
        "velocity": [0.0, 2.0],
        "start": 0.05,
        "stop": 0.15,
    },
    "visualization": {"color": "#F5F42C"},
}
JET = {
    "name": "object_3",
    "object_type": "emitter",
    "shape": {"type": "box", "center": [0.7, 0.85], "size": [0.08, 0.04]},
    "physics_properties": LIQUID,
    "emission": {"rate": 400.0, "velocity": [0.0, -1.5], "start": 0.0, "stop": 0.2},
    "visualization": {"color": "#2C90F5"},
}
RAIN = {
    "name": "cloud",
    "object_type": "emitter",
    "shape": {"type": "box", "center": [0.25, 0.85], "size": [0.25, 0.06]},
    "physics_properties": LIQUID,
    "emission": {
        "type": "rain",
        "rate": 300.0,
        "velocity": [0.3, -1.2],
        "stop": 0.5,
        "drop_radius": 0.025,
    },
    "visualization": {"color": "#2CF591"},
}
HOSE = {
    "name": "hose",
    "object_type": "emitter",
    "shape": {"type": "box", "center": [0.75, 0.85], "size": [0.06, 0.05]},
    "physics_properties": LIQUID,
    "emission": {
        "type": "hose",
        "rate": 300.0,
        "velocity": [-0.4, -1.5],
        "stop": 0.4,
        "swing_deg": 30.0,
        "period": 0.5,
    },
    "visualization": {"color": "#2C90F5"},
}
EGG = {
    "name": "egg",
    "object_type": "dynamic_body",
    "shape": {
        "type": "ellipse",
        "center": [0.52, 0.62],
        "semi_axes": [0.08, 0.12],
        "angle_deg": 20.0,
    },
    "physics_properties": ELASTIC,
    "visualization": {"color": "#F52D2C"},
}
BOWL = {
    "name": "bowl",
    "object_type": "static_collider",
    "shape": {
        "type": "ring",
        "center": [0.2, 0.3],
        "radius": 0.13,
        "thickness": 0.04,
        "opening_deg": 150.0,
        "angle_deg": 10.0,
    },
    "visualization": {"color": "#969696"},
}
BELT = {
    "name": "belt",
    "object_type": "kinematic_collider",
    "shape": {
        "type": "capsule",
        "center": [0.75, 0.4],
        "length": 0.25,
        "radius": 0.04,
        "angle_deg": 5.0,
    },
    "kinematics": {"type": "conveyor", "surface_speed": 0.8},
    "contact": {"type": "separate", "friction": 0.5},
    "visualization": {"color": "#F5F42C"},
}
ROCKER = {
    "name": "rocker",
    "object_type": "kinematic_collider",
    "shape": {
        "type": "rounded_box",
        "center": [0.6, 0.15],
        "size": [0.3, 0.06],
        "corner_radius": 0.02,
        "angle_deg": 0.0,
    },
    "kinematics": {
        "type": "oscillate",
        "amplitude": [0.05, -0.03],
        "amplitude_deg": 10.0,
        "frequency": 1.5,
        "phase_deg": 90.0,
        "start": 0.1,
    },
    "visualization": {"color": "#C32CF5"},
}


def scene_data(*objects, gravity=(0.0, -9.8), frames=4, pixels=64):
    """Plain data of a scene of 32 cells, 10 ms a frame; the four objects by default."""
    objects = objects or (BODY, OBSTACLE, FAN, JET)
    return Scene.from_data(
        {
            "schema": "mpmworlds-scene/1",
            "simulation": {
                "grid_resolution": 32,
                "time_step_dt": 4e-4,
                "substeps_per_frame": 25,
                "duration_frames": frames,
                "particles_per_cell": 4,
                "seed": 3,
            },
            "environment": {
                "gravity": list(gravity),
                "walls": {"contact": "separate", "friction": 0.0, "thickness_cells": 3},
            },
            "objects": list(objects),
            "output": {"resolution": pixels, "framerate": 30},
        }
    ).to_data()


def first_valid(draw, number):
    """Scene of the first draw, a function that gives plain data, that is valid."""
    while True:
        try:
            return Scene.from_data(draw(), str(number))
        except (SceneError, NoRoomError):
            continue


@cache
def seeds_data():
    """Plain data of the seeds by name. Not to be changed."""
    return {name: editable(scene) for name, scene in load_seeds().items()}


@cache
def random_scene(number):
    """A scene made of seeds by edits drawn from the stream of a number."""
    rng, seeds = stream(0, "test scene", str(number)), seeds_data()
    tables = first_tables()

    def composed():
        return compose(rng, tables, seeds, *draw_counts(rng, tables))[0]

    def edited():
        first, second = rng.permutation(sorted(seeds))[:2].tolist()
        data = copy.deepcopy(seeds[first])
        modify(rng, tables, data, [*seeds[first]["objects"], *seeds[second]["objects"]])
        return data

    data = first_valid(edited if number % 4 else composed, number).to_data()
    perturb(rng, tables, data)
    return with_fewest_steps(Scene.from_data(data, str(number)))


scenes = st.integers(0, MANY - 1).map(random_scene)
