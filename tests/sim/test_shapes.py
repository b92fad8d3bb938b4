"""Signed distances, outlines and reaches of shapes describe the same shape."""

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from mpmworlds.sim.program.features.shapes.box import Box
from mpmworlds.sim.program.features.shapes.capsule import Capsule
from mpmworlds.sim.program.features.shapes.circle import Circle
from mpmworlds.sim.program.features.shapes.ellipse import SLENDER, Ellipse
from mpmworlds.sim.program.features.shapes.fan_blades import FanBlades
from mpmworlds.sim.program.features.shapes.polygon import Polygon
from mpmworlds.sim.program.features.shapes.ring import Ring
from mpmworlds.sim.program.features.shapes.rounded_box import RoundedBox
from mpmworlds.sim.program.linking.texts import arguments
from mpmworlds.sim.scene.fields import polygon_area
from mpmworlds.sim.scene.objects import SHAPES
from tests.sim.lab import functions, made, vectorised

NOTCHED = ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (0.0, -0.1), (-0.2, 0.2))
STAR = tuple(
    (r * np.cos(i * np.pi / 12), r * np.sin(i * np.pi / 12))
    for i, r in enumerate(12 * (0.25, 0.12))
)
HOME = {"center": (0.5, 0.5)}


def ring(opening_deg, thickness=0.06):
    return Ring(
        type="ring", radius=0.2, thickness=thickness, opening_deg=opening_deg, **HOME
    )


GIVEN = (
    {
        "box": Box(type="box", size=(0.3, 0.1), **HOME),
        "square": Box(type="box", size=(0.2, 0.2), **HOME),
        "circle": Circle(type="circle", radius=0.2, **HOME),
        "capsule": Capsule(type="capsule", length=0.25, radius=0.05, **HOME),
        "triangle": Polygon(type="polygon", vertices=NOTCHED[:3], **HOME),
        "notched": Polygon(type="polygon", vertices=NOTCHED, **HOME),
        "clockwise": Polygon(type="polygon", vertices=NOTCHED[::-1], **HOME),
        "star": Polygon(type="polygon", vertices=STAR, **HOME),
    }
    | {
        f"fan of {n}": FanBlades(
            type="fan_blades", blade_count=n, blade_length=0.25, thickness=0.04, **HOME
        )
        for n in (2, 3, 5, 12)
    }
    | {
        f"rounded box of {radius}": RoundedBox(
            type="rounded_box", size=(0.3, 0.2), corner_radius=radius, **HOME
        )
        for radius in (0.02, 0.1)
    }
    | {
        f"ellipse of {a} x {b}": Ellipse(type="ellipse", semi_axes=(a, b), **HOME)
        for a, b in ((0.2, 0.2), (0.15, 0.25), (0.3, 0.3 / SLENDER))
    }
    | {f"ring open {angle}": ring(angle) for angle in (0.0, 40.0, 180.0, 300.0)}
    | {"thick ring": ring(240.0, thickness=0.3)}
)
OVERLAID = ("fan_blades", "ring")  # outlines of several polygons that touch or overlap
ITERATED = "ellipse"  # its distance is not exact
shapes = pytest.mark.parametrize("shape", GIVEN.values(), ids=GIVEN)


def function_of(shape):
    """The Taichi function of a shape, with its numbers: points -> normal, distance."""
    call = f"sd_{shape.type}(vec2(r[0], r[1]){arguments(shape.numbers())})"
    text = f"@ti.func\ndef surface(r):\n    return {call}"
    return vectorised(made(text).surface, 3)


FUNCTIONS = {id(shape): function_of(shape) for shape in GIVEN.values()}


def distance(shape, points):
    """Signed distance (n,) and normal (n, 2) at points (n, 2) of the shape's frame."""
    function = FUNCTIONS.get(id(shape)) or function_of(shape)
    nx, ny, d = function(*points.T)
    return d, np.stack([nx, ny], axis=1)


@shapes
def test_both_halves_of_a_shape_have_the_same_distance(shape):
    points = scattered()
    found, _ = distance(shape, points)
    np.testing.assert_allclose(shape.distance(*points.T), found, atol=1e-9)


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
    exact = outside if shape.type in OVERLAID else np.ones(len(d), bool)
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
    if shape.type in OVERLAID:
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
    atol = 1e-3 if shape.type == ITERATED else 1e-5
    np.testing.assert_allclose(normal[smooth], gradient[smooth], atol=atol)


@shapes
def test_a_step_against_the_normal_by_the_distance_leads_to_the_outline(shape):
    points = scattered()
    d, normal = distance(shape, points)
    landed, _ = distance(shape, points - d[:, None] * normal)
    atol = 2e-6 if shape.type == ITERATED else 1e-9
    np.testing.assert_allclose(landed[d > 0], 0, atol=atol)
    assert (landed < atol).all()


@shapes
def test_the_reach_holds_the_outline_tightly(shape):
    reach = shape.reach()
    farthest = np.linalg.norm(np.concatenate(shape.local_outline()), axis=1).max()
    slack = 2**0.5 if shape.type == "rounded_box" else 1.001
    assert 0.999 * farthest < reach < slack * farthest
    assert (distance(shape, scattered())[0] >= 0)[
        np.linalg.norm(scattered(), axis=1) >= reach
    ].all()


@shapes
def test_the_rim_of_a_shape_reaches_as_far_as_the_shape(shape):
    line = getattr(functions(), f"{shape.type}_line")(*shape.numbers())
    points, radius = np.array(line), shape.roundness()
    assert distance(shape, points)[0].max() <= 1e-9 - radius
    farthest = np.linalg.norm(points, axis=1).max() + radius
    assert farthest == pytest.approx(shape.reach(), rel=2e-3)


def test_every_shape_of_the_schema_is_tested():
    assert {shape.type for shape in GIVEN.values()} == set(SHAPES)


@pytest.mark.parametrize("name", ["box", "circle", "notched", "fan of 5", "capsule"])
def test_an_outline_turns_and_moves_with_its_shape(name):
    shape = GIVEN[name]
    moved = shape.outline(shift=(0.1, -0.2), turn=np.pi / 2)
    for polygon, local in zip(moved, shape.local_outline(), strict=True):
        expected = np.stack([0.6 - local[:, 1], 0.3 + local[:, 0]], axis=1)
        np.testing.assert_allclose(polygon, expected)


@pytest.mark.parametrize("axes", [(0.2, 0.2), (0.15, 0.25), (0.3, 0.3 / SLENDER)])
def test_the_distance_of_an_ellipse_is_accurate_near_its_surface(axes):
    angle = np.linspace(0, 2 * np.pi, 501)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    normal = circle / axes
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ellipse = Ellipse(type="ellipse", semi_axes=axes, **HOME)
    most = min(0.02, 0.6 * min(axes) ** 2 / max(axes))  # short of the focal line
    for away in (-most, -0.01 * most, 0.01 * most, 0.02):
        d, n = distance(ellipse, circle * axes + away * normal)
        np.testing.assert_allclose(d, away, rtol=1e-3)
        np.testing.assert_allclose(n, normal, atol=0.01)


def test_a_node_on_the_axis_of_a_capsule_has_a_normal():
    d, normal = distance(GIVEN["capsule"], np.array([[0.0, 0.0], [0.1, 0.0]]))
    np.testing.assert_allclose(d, -0.05)
    np.testing.assert_allclose(normal, [[0, 1], [0, 1]])


@pytest.mark.parametrize(
    ("make", "numbers", "message"),
    [
        (Box, {"size": (0.0, 0.1)}, "both must be > 0"),
        (RoundedBox, {"size": (0.3, 0.1), "corner_radius": 0.06}, ">= 2 x corner_rad"),
        (RoundedBox, {"size": (1.3, 0.1), "corner_radius": 0.02}, "both must be <= 1"),
        (Ellipse, {"semi_axes": (0.0, 0.1)}, "both must be > 0"),
        (Ellipse, {"semi_axes": (0.02, 0.2)}, "one must be <= 5 x the other"),
        (Ring, {"radius": 0.1, "thickness": 0.2}, "must be < 2 x radius = 0.2"),
        (
            Ring,
            {"radius": 0.1, "thickness": 0.05, "opening_deg": 20.0},
            "opening_deg = 20, must leave a gap between the round ends",
        ),
    ],
)
def test_measures_that_do_not_fit_each_other_are_refused(make, numbers, message):
    kind = make.model_fields["type"].annotation.__args__[0]
    with pytest.raises(ValidationError, match=message):
        make(type=kind, **numbers, **HOME)


def area(shape):
    return sum(map(polygon_area, shape.local_outline()))


def test_areas_are_those_of_geometry():
    disc = np.pi * 0.2**2
    assert area(GIVEN["circle"]) == pytest.approx(disc)
    assert area(GIVEN["ellipse of 0.2 x 0.2"]) == pytest.approx(disc)
    assert area(GIVEN["ellipse of 0.3 x 0.06"]) == pytest.approx(
        disc * 0.3 * 0.06 / 0.04
    )
    assert area(GIVEN["box"]) == pytest.approx(0.03)
    assert area(GIVEN["star"]) == pytest.approx(12 * 0.25 * 0.12 * np.sin(np.pi / 12))
    assert polygon_area(NOTCHED) == polygon_area(NOTCHED[::-1]) == pytest.approx(0.1)
    bar = 0.25 * 0.1 + np.pi * 0.05**2
    assert area(GIVEN["capsule"]) == pytest.approx(bar, rel=1e-3)
    plate = 0.3 * 0.2 - (4 - np.pi) * 0.1**2
    assert area(GIVEN["rounded box of 0.1"]) == pytest.approx(plate, rel=1e-3)
    assert area(ring(0.0)) == pytest.approx(2 * np.pi * 0.2 * 0.06)
    bowl = np.pi * 0.2 * 0.06 + np.pi * 0.03**2
    assert area(ring(180.0)) == pytest.approx(bowl, rel=1e-3)


def test_a_bowl_is_open_above_its_center_and_closed_below():
    above, center, below = [0.0, 0.2], [0.0, 0.0], [0.0, -0.2]
    d, _ = distance(ring(180.0), np.array([above, center, below]))
    np.testing.assert_allclose(d, [0.2 * 2**0.5 - 0.03, 0.17, -0.03])
