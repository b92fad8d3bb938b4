"""Numbers are found in few runs, and what promises most is tried first."""

import math
from dataclasses import replace

import pytest

from mpmworlds.baselines.search.trials.lab import BudgetSpent
from mpmworlds.baselines.search.trials.moves import Doubt, Move, moves_of
from mpmworlds.baselines.search.trials.refine import refine
from tests.baselines.search.worlds import world


def shifting(name, step, weight=1.0):
    def change(data, by):
        data[name] += by

    return Move(name, step, weight, change)


def valley(data):
    return (data["x"] - 0.7) ** 2 + 2.0 * (data["y"] + 0.3) ** 2


def bowl(data):  # with an edge at its bottom, as overlaps have
    return abs(data["x"] - 0.7) + 2.0 * abs(data["y"] + 0.3)


@pytest.mark.parametrize(("loss", "left"), [(valley, 1e-3), (bowl, 0.06)])
def test_the_bottom_is_found_in_few_runs(loss, left):
    runs = []

    def tried(data, what):
        runs.append(what)
        return loss(data)

    start = {"x": 0.0, "y": 0.0}
    moves = [shifting("x", 0.3), shifting("y", 0.3)]
    found, least = refine(start, loss(start), moves, tried, 0.08, lambda: True, {})
    assert (start, least) == ({"x": 0.0, "y": 0.0}, loss(found))
    assert least < left
    assert len(runs) < 45


def test_what_promises_most_is_first_and_what_does_not_help_is_left():
    runs = []

    def tried(data, what):
        runs.append(what)
        return valley({"y": 0.0} | data)

    start = {"x": 0.0, "z": 0.0}
    moves = [shifting("z", 0.3, 0.6), shifting("x", 0.3, 1.0)]
    refine(start, valley({"y": 0.0} | start), moves, tried, 0.08, lambda: True, {})
    assert runs[0] == "x"
    assert runs.count("z") <= 8


def test_a_budget_that_is_spent_ends_it():
    def tried(data, what):
        raise BudgetSpent

    with pytest.raises(BudgetSpent):
        refine({"x": 0.0}, 1.0, [shifting("x", 0.1)], tried, 0.1, lambda: True, {})


def test_what_is_told_is_not_moved_and_the_worst_thing_comes_first():
    data = world("brick", "ball", "jet", "still").to_data()
    told = {
        0: {"initial_state": {"velocity": [0.3, 0.6], "angular_velocity": 2.0}},
        1: {"physics_properties": data["objects"][1]["physics_properties"]},
        3: {"contact": {}},
    }
    doubt = Doubt(told, {}, (), (), walls=False)
    by_color = {thing["visualization"]["color"]: 0.1 for thing in data["objects"]}
    by_color[data["objects"][2]["visualization"]["color"]] = 0.4
    moves = list(moves_of(data, doubt, by_color))
    names = {move.what for move in moves}
    assert names == {
        *("0.physics_properties.youngs_modulus", "1.velocity[0]", "1.velocity[1]"),
        *("2.emission.rate", "2.speed", "2.direction", "2.width"),
        *("2.physics_properties.viscosity", "2.physics_properties.bulk_modulus"),
    }
    assert max(moves, key=lambda move: move.weight).what.startswith("2.")


def test_how_a_body_starts_is_not_moved_if_it_was_seen():
    data = world("brick", "ball").to_data()
    doubt = Doubt({}, {}, {0}, (), walls=True)
    starts = {m.what for m in moves_of(data, doubt, {}) if "velocity" in m.what}
    assert starts == {"1.velocity[0]", "1.velocity[1]"}


def test_what_shows_least_is_moved_only_where_all_else_is_near():
    data = world("brick", "ball", "jet", "still").to_data()
    doubt = Doubt({1: {"shape": data["objects"][1]["shape"]}}, {}, (), (), walls=True)
    coarse, fine = (
        {m.what: m for m in moves_of(data, doubt, {}, fine=fine)}
        for fine in (False, True)
    )
    assert fine.keys() - coarse.keys() == {
        *("0.physics_properties.poissons_ratio", "0.physics_properties.density"),
        *("0.size", "0.aspect", "0.angle", "0.center[0]", "0.center[1]"),
        *("1.physics_properties.poissons_ratio", "1.physics_properties.density"),
    }
    data["objects"][1]["initial_state"] |= {"angular_velocity": 3.0}
    spun = {m.what for m in moves_of(data, doubt, {}, fine=True)}
    assert spun - fine.keys() == {"1.spin"}  # of a ball: it shows when it lands
    wider = fine["0.aspect"].of(data, 0.1)["objects"][0]["shape"]["size"]
    before = data["objects"][0]["shape"]["size"]
    assert wider[0] > before[0]
    assert wider[0] * wider[1] == pytest.approx(before[0] * before[1])


def test_a_jet_stays_as_dense_when_it_is_made_wider_or_faster():
    data = world("jet").to_data()
    moves = {m.what: m for m in moves_of(data, Doubt({}, {}, (), (), walls=True), {})}
    before = data["objects"][0]["emission"]["rate"]
    for name in ("0.speed", "0.width"):
        changed = moves[name].of(data, 0.3)["objects"][0]["emission"]["rate"]
        assert changed > 1.3 * before


def test_a_jet_is_turned_about_its_nozzle():
    data = world("jet").to_data()
    moves = {m.what: m for m in moves_of(data, Doubt({}, {}, (), (), walls=True), {})}
    (before,), (after,) = (
        scene["objects"]
        for scene in (data, moves["0.direction"].of(data, math.radians(90.0)))
    )
    u, v = before["emission"]["velocity"]
    assert after["emission"]["velocity"] == pytest.approx([-v, u])
    assert after["shape"]["angle_deg"] == pytest.approx(
        before["shape"]["angle_deg"] + 90
    )
    assert after["shape"]["center"] == before["shape"]["center"]


def test_the_swing_of_a_hose_is_moved():
    data = world("jet").to_data()
    data["objects"][0]["emission"] |= {
        "type": "hose",
        "swing_deg": -20.0,
        "period": 1.0,
    }
    moves = {m.what: m for m in moves_of(data, Doubt({}, {}, (), (), walls=True), {})}
    swung = moves["0.emission.swing_deg"].of(data, 0.1)["objects"][0]["emission"]
    assert swung["swing_deg"] < -20.0 and swung["period"] == 1.0
    assert {"0.emission.period", "0.direction"} <= moves.keys()


def test_another_gravity_leaves_flights_where_they_were_seen():
    data = world("brick").to_data()
    doubt = Doubt({}, {0: 0.4}, (), (1,), walls=False)
    (pull,) = (m for m in moves_of(data, doubt, {}) if m.what == "gravity[1]")
    changed = pull.of(data, -1.0)
    assert changed["environment"]["gravity"] == [0.0, -10.8]

    def height(scene, t):
        velocity = scene["objects"][0]["initial_state"]["velocity"][1]
        return velocity * t + 0.5 * scene["environment"]["gravity"][1] * t**2

    off = [abs(height(changed, t) - height(data, t)) for t in (0.1, 0.2, 0.3, 0.4)]
    assert max(off) < 0.25 * 0.5 * 0.4**2


def test_the_friction_of_walls_is_moved_where_it_tells_and_is_not_told():
    data = world("brick").to_data()
    before = data["environment"]["walls"] = {"contact": "slip", "friction": 0.2}
    doubt = Doubt({}, {}, (), (), walls=True)
    (move,) = (m for m in moves_of(data, doubt, {}) if m.what == "walls.friction")
    changed = [move.of(data, by)["environment"]["walls"] for by in (0.05, -0.5, 2.0)]
    assert [walls["friction"] for walls in changed] == pytest.approx([0.25, 0.0, 1.0])
    assert before == {"contact": "slip", "friction": 0.2}
    told = replace(doubt, walls=False)
    assert not any("walls" in m.what for m in moves_of(data, told, {}))
    before["contact"] = "sticky"
    assert not any("walls" in m.what for m in moves_of(data, doubt, {}))
