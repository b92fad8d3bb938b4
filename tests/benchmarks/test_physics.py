"""Checks tell right from wrong, and reports say so; references are what they claim."""

import math

import numpy as np
import pytest
from benchmarks.physics.case import Case, Curve, Plot, Result, at_least, at_most, near
from benchmarks.physics.contact import signed_depth
from benchmarks.physics.liquid import film_profile
from benchmarks.physics.report import draw, table
from benchmarks.physics.world import body, box, disc, matter, obstacle, world


@pytest.mark.parametrize(
    ("check", "ok"),
    [
        (near("a", 1.04, 1.0, 0.05, "b"), True),
        (near("a", 0.94, 1.0, 0.05, "b"), False),
        (near("a", 0.94, 1.0, 0.05, "b", scale=2.0), True),
        (at_most("a", 1.0, 1.0, "b"), True),
        (at_most("a", 1.1, 1.0, "b"), False),
        (at_least("a", 1.1, 1.0, "b"), True),
        (at_least("a", 0.9, 1.0, "b"), False),
        (near("a", math.nan, 1.0, 0.05, "b"), False),
        (at_most("a", math.nan, 1.0, "b"), False),
    ],
)
def test_check_is_ok_within_its_tolerance(check, ok):
    assert check.ok == ok


def test_table_has_a_row_for_each_check_and_marks_failures():
    case = Case("it_falls", lambda cells: Result([]), 32, 64, slow=False)
    checks = [at_most("speed", 1.0, 2.0, "s"), at_most("depth", 3.0, 2.0, "s")]
    rows = table({case: Result(checks)}, coarse=True).splitlines()[2:]
    assert ["failed" in row for row in rows] == [False, True]
    assert all("it falls | 32 |" in row for row in rows)


def test_equal_plots_are_equal_files(tmp_path):
    plot = Plot("t", "x", "y", [Curve("a", [0, 1], [1, 2], reference=True)])
    for name in ("one.png", "two.png"):
        draw([plot], tmp_path / name)
    one, two = (tmp_path.joinpath(f"{n}.png").read_bytes() for n in ("one", "two"))
    assert one == two and one.startswith(b"\x89PNG")


def test_depth_in_a_disc_is_radius_less_distance():
    block = body(box((0.8, 0.8), 0.1, 0.1), matter("elastic"))
    scene = world(block, obstacle(disc((0.3, 0.3), 0.1)), cells=32, seconds=0.01)
    points = np.array([[0.5, 0.5], [0.58, 0.5], [0.5, 0.44], [0.9, 0.9]])
    depth = signed_depth(scene, 1, np.array([0.5, 0.5, 1.0]), points)
    np.testing.assert_allclose(depth[:3], [0.1, 0.02, 0.04], atol=2e-4)
    assert depth[3] < 0.0


def test_film_ends_as_a_parabola_and_starts_at_the_pull():
    y, h, nu, pull = np.linspace(0.0, 0.1, 6), 0.1, 0.05, 2.0
    parabola = pull / nu * (h * y - 0.5 * y**2)
    np.testing.assert_allclose(film_profile(y, 99.0, h, nu, pull), parabola, rtol=1e-3)
    early = film_profile(y, 1e-3, h, nu, pull)
    np.testing.assert_allclose(early[2:], pull * 1e-3, rtol=0.02)
