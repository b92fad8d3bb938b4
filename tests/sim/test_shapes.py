"""Signed distances, outlines and reaches of shapes describe the same shape."""

import cv2
import numpy as np
import pytest
import taichi as ti
from taichi.math import vec2

from mpmworlds.sim.fields import polygon_area
from mpmworlds.sim.physics.shapes import sd_box, sd_circle, sd_fan, sd_polygon
from mpmworlds.sim.shapes import SHAPES, Box, Circle, FanBlades, Polygon
from tests.sim.lab import vectorised

NOTCHED = ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (0.0, -0.1), (-0.2, 0.2))
HOME = {"center": (0.5, 0.5)}
GIVEN = {
    "box": Box(type="box", size=(0.3, 0.1), **HOME),
    "square": Box(type="box", size=(0.2, 0.2), **HOME),
    "circle": Circle(type="circle", radius=0.2, **HOME),
    "triangle": Polygon(type="polygon", vertices=NOTCHED[:3], **HOME),
    "notched": Polygon(type="polygon", vertices=NOTCHED, **HOME),
    "clockwise": Polygon(type="polygon", vertices=NOTCHED[::-1], **HOME),
} | {
    f"fan of {n}": FanBlades(
        type="fan_blades", blade_count=n, blade_length=0.25, thickness=0.04, **HOME
    )
    for n in (2, 3, 5, 12)
}
shapes = pytest.mark.parametrize("shape", GIVEN.values(), ids=GIVEN)
corners = ti.Vector.field(2, ti.f64, (1, 16))


@ti.func
def _box(r):
    return sd_box(vec2(r[0], r[1]), vec2(r[2], r[3]))


@ti.func
def _circle(r):
    return sd_circle(vec2(r[0], r[1]), r[2])


@ti.func
def _fan(r):
    return sd_fan(vec2(r[0], r[1]), r[2], r[3], r[4])


@ti.func
def _polygon(r):
    return sd_polygon(vec2(r[0], r[1]), corners, 0, int(r[2]))


FUNCTIONS = {
    "box": vectorised(_box, 3),
    "circle": vectorised(_circle, 3),
    "fan_blades": vectorised(_fan, 3),
    "polygon": vectorised(_polygon, 3),
}


def distance(shape, points):
    """Signed distance (n,) and normal (n, 2) at points (n, 2) of the shape's frame."""
    numbers = eval(f"[{shape.MEASURES}]", {"shape": shape.model_dump()})
    if shape.type == "polygon":
        for i, vertex in enumerate(shape.vertices):
            corners[0, i] = vertex
    d, nx, ny = FUNCTIONS[shape.type](*points.T, *numbers)
    return d, np.stack([nx, ny], axis=1)


def scattered(n=500, side=0.8):
    return np.random.default_rng(5).uniform(-side / 2, side / 2, (n, 2))


def reference(shape, points):
    """Signed distance by OpenCV to the union of the outline's polygons.

    It is exact outside and of the right sign inside; inside of one polygon it is exact.
    """
    return -np.max(
        [
            [
                cv2.pointPolygonTest(polygon.astype(np.float32), tuple(p), True)
                for p in points.astype(np.float32).tolist()
            ]
            for polygon in shape.local_outline()
        ],
        axis=0,
    )


@shapes
def test_distance_agrees_with_the_outline(shape):
    points = scattered()
    d, _ = distance(shape, points)
    expected = reference(shape, points)
    outside = expected > 1e-3
    assert outside.sum() > 50
    assert (d[outside] > 0).all()
    assert (d[expected < -1e-3] < 0).all()
    exact = outside if shape.type == "fan_blades" else np.ones(len(d), bool)
    np.testing.assert_allclose(d[exact], expected[exact], atol=3e-4)


@shapes
def test_distance_vanishes_on_the_outline(shape):
    outline = np.concatenate(shape.local_outline())
    along = np.concatenate(
        [
            polygon + s * (np.roll(polygon, -1, axis=0) - polygon)
            for polygon in shape.local_outline()
            for s in (0.0, 0.3)
        ]
    )
    d, _ = distance(shape, along)
    if shape.type == "fan_blades":  # blades cover parts of each other's outline
        assert (d < 3e-4).all()
        d, _ = distance(shape, outline[np.linalg.norm(outline, axis=1) > 0.2])
    np.testing.assert_allclose(d, 0, atol=3e-4)


@shapes
def test_normal_is_the_unit_gradient_of_the_distance(shape):
    points, step = scattered(), 1e-6
    _, normal = distance(shape, points)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1)
    gradient = np.stack(
        [
            (distance(shape, points + e)[0] - distance(shape, points - e)[0]) / 2 / step
            for e in step * np.eye(2)
        ],
        axis=1,
    )
    smooth = abs(np.linalg.norm(gradient, axis=1) - 1) < 1e-6
    assert smooth.mean() > 0.98
    np.testing.assert_allclose(normal[smooth], gradient[smooth], atol=1e-5)


@shapes
def test_a_step_against_the_normal_by_the_distance_leads_to_the_outline(shape):
    points = scattered()
    d, normal = distance(shape, points)
    landed, _ = distance(shape, points - d[:, None] * normal)
    np.testing.assert_allclose(landed[d > 0], 0, atol=1e-9)
    assert (landed < 1e-9).all()


@shapes
def test_the_reach_holds_the_outline_tightly(shape):
    reach = eval(shape.REACH, {"shape": shape.model_dump(), "np": np})
    farthest = np.linalg.norm(np.concatenate(shape.local_outline()), axis=1).max()
    assert reach == pytest.approx(farthest, rel=1e-3)
    assert (distance(shape, scattered())[0] >= 0)[
        np.linalg.norm(scattered(), axis=1) >= reach
    ].all()


def test_every_shape_of_the_schema_is_tested():
    assert {shape.type for shape in GIVEN.values()} == set(SHAPES) == set(FUNCTIONS)


@pytest.mark.parametrize("name", ["box", "circle", "notched", "fan of 5"])
def test_an_outline_turns_and_moves_with_its_shape(name):
    shape = GIVEN[name]
    moved = shape.outline(shift=(0.1, -0.2), turn=np.pi / 2)
    for polygon, local in zip(moved, shape.local_outline(), strict=True):
        expected = np.stack([0.6 - local[:, 1], 0.3 + local[:, 0]], axis=1)
        np.testing.assert_allclose(polygon, expected)


def test_areas_are_those_of_geometry():
    (disc,) = GIVEN["circle"].local_outline()
    assert polygon_area(disc) == pytest.approx(np.pi * 0.2**2)
    assert polygon_area(GIVEN["box"].local_outline()[0]) == pytest.approx(0.03)
    assert polygon_area(NOTCHED) == polygon_area(NOTCHED[::-1]) == pytest.approx(0.1)
