"""Numbers that many scenes share are tried exactly where a scene is near to them."""

import math

import pytest

from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.trials.exact import exact
from mpmworlds.baselines.search.trials.lab import Lab
from mpmworlds.baselines.search.trials.moves import Doubt
from mpmworlds.baselines.search.trials.readings import Trial
from mpmworlds.baselines.search.trials.search import Search
from mpmworlds.baselines.search.trials.tried import Known, Tried
from mpmworlds.baselines.search.trials.unusual import ODD_WALLS, unusual
from tests.baselines.search.worlds import FORM, prefix_of, world

TILTED = [0.9, -10.0]


def scene(gravity=(0.0, -9.8), spin=0.0, heading=0.0):
    data = world("brick", "jet").to_data()
    data["environment"]["gravity"] = list(gravity)
    data["objects"][0]["initial_state"]["angular_velocity"] = spin
    jet = data["objects"][1]
    down = math.radians(heading - 90.0)
    jet["emission"]["velocity"] = [1.5 * math.cos(down), 1.5 * math.sin(down)]
    jet["shape"]["angle_deg"] = heading
    return data


def tried(data, **changes):
    known = {"told": {}, "flights": {}, "started": (), "gravity": (1, 0)}
    doubt = Doubt(**(known | {"walls": True} | changes))
    return dict(exact(data, doubt, prior()))


def test_nothing_is_tried_where_all_is_usual_already():
    assert tried(scene()) == {}


def test_a_gravity_near_to_that_of_the_earth_is_tried_as_that():
    found = tried(scene(TILTED), flights={0: 0.2})
    (changed,) = found.values()
    assert changed["environment"]["gravity"] == [0.0, -9.8]
    before = scene(TILTED)["objects"][0]["initial_state"]["velocity"]
    after = changed["objects"][0]["initial_state"]["velocity"]
    # The flight that was seen stays as it was, about.
    assert after[0] - before[0] == pytest.approx(0.375 * 0.9 * 0.2)
    assert unusual(changed, prior(), None) < unusual(scene(TILTED), prior(), None)


@pytest.mark.parametrize(
    ("gravity", "doubted"), [((3.5, -6.6), (1, 0)), (TILTED, ())], ids=["far", "known"]
)
def test_a_gravity_that_is_far_or_known_is_left(gravity, doubted):
    assert tried(scene(gravity), gravity=doubted) == {}


def on_walls(law, friction):
    data = scene()
    data["environment"]["walls"] |= {"contact": law, "friction": friction}
    return data


def test_a_friction_of_the_walls_is_tried_as_the_nearest_usual_one():
    odd, usual = on_walls("slip", 0.17), on_walls("slip", 0.2)
    assert tried(odd) == {"a usual friction of the walls": usual}
    assert unusual(usual, prior(), None) < unusual(odd, prior(), None)
    assert unusual(odd, prior(), None) < unusual(on_walls("slip", 0.15), prior(), None)
    assert tried(odd, walls=False) == tried(usual) == {}


@pytest.mark.parametrize(
    ("saved", "answered"), [(0.5 * ODD_WALLS, 0.2), (2.0 * ODD_WALLS, 0.17)]
)
def test_an_odd_friction_of_the_walls_is_answered_with_only_if_much_tells_so(
    saved, answered
):
    odd, usual = on_walls("slip", 0.17), on_walls("slip", 0.2)
    doubt = Doubt({}, {}, (), (), walls=True)
    with Lab(labels_of(prefix_of(world("brick"))), FORM, 1, 1.0) as lab:
        search = Search(Tried(lab, prior(), Known(doubt, None, {}, (), {})))
        trials = Trial(0.05 - saved, odd, "odd"), Trial(0.05, usual, "usual")
        search.trials.extend(trials)
        assert search.best.data == odd  # from where search goes on
        (answer,) = search.candidates(1)
    assert answer.data["environment"]["walls"]["friction"] == answered


def test_a_spin_that_is_not_seen_is_tried_without():
    (changed,) = tried(scene(spin=0.4)).values()
    assert changed == scene()
    assert unusual(changed, prior(), None) < unusual(scene(spin=0.4), prior(), None)
    assert tried(scene(spin=0.4), started=[0]) == {}
    assert (
        tried(scene(spin=0.4), told={0: {"initial_state": {"angular_velocity": 0.4}}})
        == {}
    )


def test_a_nozzle_that_nearly_points_down_is_tried_so():
    (changed,) = tried(scene(heading=6.0)).values()
    jet = changed["objects"][1]
    assert jet["emission"]["velocity"] == pytest.approx([0.0, -1.5], abs=1e-9)
    assert jet["shape"]["angle_deg"] == pytest.approx(0.0, abs=1e-9)
    assert tried(scene(heading=25.0)) == {}
