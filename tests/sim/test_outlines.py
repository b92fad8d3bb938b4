"""Outlines tell where a shape is: what overlaps, and where its center of mass is."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.sim.program.features.shapes.box import Box
from mpmworlds.sim.program.features.shapes.circle import Circle
from mpmworlds.sim.program.features.shapes.fan_blades import FanBlades
from mpmworlds.sim.program.features.shapes.polygon import Polygon
from mpmworlds.sim.program.features.shapes.ring import Ring
from mpmworlds.sim.scene.checks import overlap
from mpmworlds.sim.scene.outlines import centroid

NOTCHED = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [0.0, -0.1], [-0.2, 0.2]]


@settings(max_examples=60, deadline=None)
@given(
    angle=st.floats(0, 2 * math.pi),
    gap=st.floats(-0.1, 0.1).filter(lambda g: abs(g) > 0.006),
    radii=st.tuples(st.floats(0.06, 0.2), st.floats(0.06, 0.2)),
)
def test_discs_overlap_where_centers_are_nearer_than_the_radii(angle, gap, radii):
    distance = sum(radii) + gap
    ends = [
        (0.5, 0.5),
        (0.5 + distance * np.cos(angle), 0.5 + distance * np.sin(angle)),
    ]
    one, other = (
        Circle(type="circle", center=end, radius=r).outline()
        for end, r in zip(ends, radii, strict=True)
    )
    assert overlap(one, other) == (gap < 0)


@pytest.mark.parametrize(
    ("size", "apart"), [((0.05, 0.05), True), ((0.3, 0.05), False)]
)
def test_a_body_may_lie_in_the_notch_of_another(size, apart):
    notched = Polygon(type="polygon", center=(0.5, 0.5), vertices=NOTCHED).outline()
    box = Box(type="box", center=(0.5, 0.62), size=size).outline()
    assert overlap(notched, box) is not apart


def test_the_centroid_of_a_triangle_is_the_mean_of_its_corners():
    corners = np.array([[0.0, 0.0], [0.3, 0.0], [0.1, 0.2]])
    for outline in (corners, corners[::-1]):
        np.testing.assert_allclose(centroid([outline]), corners.mean(axis=0))


def test_the_centroid_of_two_boxes_is_their_mean_by_area():
    boxes = [
        Box(type="box", center=center, size=size).outline()[0]
        for center, size in (((0.2, 0.5), (0.2, 0.1)), ((0.8, 0.5), (0.2, 0.3)))
    ]
    np.testing.assert_allclose(centroid(boxes), [0.65, 0.5])


@pytest.mark.parametrize(
    "shape",
    [
        FanBlades(
            type="fan_blades",
            center=(0.5, 0.5),
            blade_count=5,
            blade_length=0.1,
            thickness=0.02,
        ),
        Ring(type="ring", center=(0.5, 0.5), radius=0.1, thickness=0.02),
    ],
    ids=["fan", "ring"],
)
def test_shapes_alike_all_around_are_centered_on_their_mass(shape):
    np.testing.assert_allclose(centroid(shape.local_outline()), 0, atol=1e-12)
