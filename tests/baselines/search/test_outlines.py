"""Outlines that many polygons share: counted, and found again in what is seen."""

import copy

import numpy as np
import pytest

from mpmworlds.baselines.search.guess import look
from mpmworlds.baselines.search.outlines import usual_outlines
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.perception.pixels import Pixels, covered
from mpmworlds.baselines.search.perception.shapes import fit_shape
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.side import Told
from tests.baselines.search.worlds import COLORS, FRAME, checked, prefix_of, world

PIXELS = Pixels.of(256, 512)
WEDGE = [[-0.1, -0.05], [0.3, -0.05], [-0.1, 0.25]]
KITE = [[0.0, -0.3], [0.1, 0.0], [0.0, 0.1], [-0.1, 0.0]]


def area(corners):
    x, y = np.array(corners).T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def made(corners, size=1.0, mirrored=False, first=0):
    placed = np.roll(np.array(corners) * size, first, axis=0)
    return (placed * [-1, 1] if mirrored else placed).tolist()


def test_what_is_turned_inside_out_larger_or_begins_elsewhere_is_one_outline():
    found = usual_outlines(
        [made(WEDGE), made(WEDGE, 0.3), made(WEDGE, 2.0, mirrored=True, first=1)]
        + [made(KITE)] * 2
    )
    assert [len(outline) for outline in found] == [3, 4]
    wedge = np.array(WEDGE) / np.sqrt(area(WEDGE))
    assert any(np.allclose(np.roll(found[0], k, 0), wedge, atol=1e-4) for k in range(3))


def test_what_few_have_is_no_usual_outline():
    assert len(usual_outlines([made(WEDGE)] * 300 + [made(KITE)])) == 1


def test_recorded_outlines_enclose_one_square_metre():
    assert len(prior().outlines) == 23
    for outline in prior().outlines:
        assert area(outline) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("number", range(len(prior().outlines)))
def test_a_usual_outline_is_seen_for_what_it_is(number, mirrored):
    outline = prior().outlines[number]
    shape = {
        "type": "polygon",
        "center": [0.47, 0.52],
        "angle_deg": 37.0,
        "vertices": made(outline, 0.13, mirrored=mirrored),
    }
    fit = fit_shape(covered(shape, PIXELS), PIXELS, outlines=prior().outlines)
    assert len(fit.shape["vertices"]) == len(outline)
    fine = Pixels.of(1024, 1024)
    there, found = covered(shape, fine), covered(fit.shape, fine)
    assert (there & found).sum() / (there | found).sum() > 0.985


def test_a_thin_tray_that_swings_is_no_body():
    """Its sides are eight pixels wide: half a pixel off is a twentieth of it."""
    data = world("fan", "ball").to_data()
    data["objects"][0] |= {
        "shape": {
            "type": "polygon",
            "center": [0.53, 0.3],
            "angle_deg": 4.6,
            "vertices": made(prior().outlines[3], 0.17),
        },
        "kinematics": {
            "type": "oscillate",
            "amplitude": [0.0, 0.0],
            "amplitude_deg": 31.8,
            "frequency": 0.89,
            "phase_deg": 0.0,
        },
    }
    prefix = prefix_of(checked(copy.deepcopy(data)))
    sight = look(labels_of(prefix), PIXELS, FRAME, Told(), seed=0)
    thing = next(t for t in sight.things if t.track.color == COLORS[0])
    assert thing.kind == "kinematic_collider"
    motion = thing.laws[0].kinematics
    assert motion["frequency"] == pytest.approx(0.89, rel=0.01)
    assert motion["amplitude_deg"] == pytest.approx(31.8, rel=0.01)
    assert thing.fit.shape["center"] == pytest.approx([0.53, 0.3], abs=0.002)
