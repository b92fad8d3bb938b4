"""What cannot be seen is told apart by simulation, within a budget."""

import copy
import dataclasses
import itertools

import numpy as np
import pytest
import yaml

from mpmworlds.baselines.protocol import Failure, SceneText, Task
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.scoring import task_of
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.perception.evolution import evolve
from mpmworlds.baselines.search.perception.simplex import descend
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.repair import repaired, written
from mpmworlds.baselines.search.side import over, read_side
from mpmworlds.baselines.search.trials.classes import Classes
from mpmworlds.baselines.search.trials.lab import BudgetSpent, Lab
from mpmworlds.baselines.search.trials.loss import Reference
from mpmworlds.baselines.search.trials.moves import Doubt
from mpmworlds.baselines.search.trials.search import EVENED, Search
from mpmworlds.baselines.search.trials.tried import Known, Tried
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.sim.scene.objects import MATERIALS
from mpmworlds.sim.scene.scene import Scene
from tests.baselines.search.worlds import FORM, FRAMES, checked, prefix_of, world

SMALL = VideoForm(150, 15, 128)
# Of one family: what differs between these shows in more than 2.5 s of a small fall.
ALIKE = ({"elastic", "elastic_fem"}, {"sand", "wet_sand"}, {"elastic", "rigid"})
ALIKE += ({"elastic_fem", "rigid"},)


def fall(material, **changes):
    """A small scene: a body that falls on a peg and moves aside."""
    data = world("brick", "still", cells=64, form=SMALL).to_data()
    body = data["objects"][0]
    body["physics_properties"] = prior().typical(material) | changes
    body["shape"] |= {"center": [0.3, 0.4], "size": [0.2, 0.2], "angle_deg": 0.0}
    body["initial_state"] = {"velocity": [0.4, -1.5], "angular_velocity": 0.0}
    data["simulation"]["seed"] = len(changes)
    return Scene.from_yaml(written(data))


@pytest.mark.slow
def test_each_class_of_material_is_told_apart_by_the_prefix():
    seen = {}
    for name in MATERIALS:
        density = 1.1 * prior().typical(name)["density"]
        seen[name] = Reference(labels_of(prefix_of(fall(name, density=density))))
    drawn = {name: prefix_of(fall(name)) for name in MATERIALS}
    wrong = [
        {truth, best}
        for truth, reference in seen.items()
        if (best := min(drawn, key=lambda n: reference.loss(drawn[n]))) != truth
    ]
    assert all(pair in ALIKE for pair in wrong), wrong
    assert len(wrong) <= 2, wrong


def test_a_prefix_has_no_loss_against_itself():
    frames = prefix_of(fall("liquid"))
    reference = Reference(labels_of(frames))
    assert reference.loss(frames) == 0.0
    assert reference.loss(np.zeros_like(frames)) > 0.9
    near, far = (np.roll(frames, k, axis=2) for k in (2, 20))
    assert reference.loss(near) < reference.loss(far)


def test_a_lab_runs_a_scene_once_and_within_its_budget():
    scene = fall("liquid").to_data()
    with Lab(labels_of(prefix_of(fall("liquid"))), SMALL, 1, 60.0) as lab:
        assert lab.loss(scene) == lab.loss(scene) < 0.01
        assert (lab.runs, lab.left) == (1, 0.0)
        with pytest.raises(BudgetSpent):
            lab.loss(fall("sand").to_data())


def test_a_search_ends_where_nothing_may_be_changed():
    told = fall("sand").to_data()
    doubt = Doubt(dict(enumerate(told["objects"])), {}, (), (), walls=False)
    known = Known(doubt, (0.0, -9.8), {}, (), {})
    with Lab(labels_of(prefix_of(fall("liquid"))), SMALL, 50, 1e6) as lab:
        search = Search(Tried(lab, prior(), known))
        search.run([told])
        assert lab.runs == 1 and search.best.loss > 0.1


def test_a_gravity_that_no_flight_tells_is_found_with_common_matter():
    """What is made up for by other matter under a wrong gravity keeps it wrong."""
    truth = fall("elastic").to_data()
    truth["environment"]["gravity"] = [3.5, -6.6]
    right = Scene.from_yaml(written(truth)).to_data()
    wrong = right | {"environment": right["environment"] | {"gravity": [0.0, -9.8]}}
    doubt = Doubt({0: {}, 1: {}}, {}, (), (), walls=False)
    known = Known(doubt, None, {0: 5}, (), {})
    seen = prefix_of(Scene.from_yaml(written(truth)))
    with Lab(labels_of(seen), SMALL, 90, 1e6) as lab:
        search = Search(Tried(lab, prior(), known))
        search.run([wrong], far=[right])
        assert search.best.data["environment"]["gravity"] == [3.5, -6.6]
        assert search.best.loss < 0.1


def test_walls_end_with_a_friction_that_walls_have():
    """Other numbers are found again with it, not only put beside it."""
    truth = fall("elastic").to_data()
    truth["environment"]["walls"]["friction"] = 0.2
    start = copy.deepcopy(truth)
    start["environment"]["walls"]["friction"] = 0.24
    start["objects"][0]["physics_properties"]["youngs_modulus"] *= 1.3
    told = dict(enumerate(truth["objects"]))
    told[0] = {k: v for k, v in told[0].items() if k != "physics_properties"}
    known = Known(Doubt(told, {}, (), (), walls=True), (0.0, -9.8), {0: 5}, (), {})
    with Lab(labels_of(prefix_of(checked(truth))), SMALL, 120, 1e6) as lab:
        search = Search(Tried(lab, prior(), known))
        search.run([start])
        (found,) = search.candidates(1)
        assert found.data["environment"]["walls"]["friction"] == 0.2
        assert any(t.what == EVENED for t in search.trials)
        assert lab.loss(found.data) < 0.5 * lab.loss(start)


def test_common_classes_are_tried_of_each_thing():
    """What shows little at first may be ranked behind any other class."""
    scene = fall("liquid").to_data()
    doubt = Doubt({0: {}, 1: {}}, {}, (), (), walls=False)
    with Lab(labels_of(prefix_of(fall("liquid"))), SMALL, 60, 1e6) as lab:
        classes = Classes(Tried(lab, prior(), Known(doubt, None, {0: 5}, (), {})))
        classes.all_alike(scene)
        assert classes.rivals(0)[0] == "liquid"
        assert {"liquid", "elastic", "snow"} <= set(classes.rivals(0))


def example(scene, **row):
    """A sample whose continuation is of no interest."""
    prefix = prefix_of(scene)
    form = scene.output
    row = {
        "id": "x",
        "num_frames": scene.simulation.duration_frames,
        "framerate": form.framerate,
        "resolution": form.resolution,
        "scene": scene.to_yaml(),
        "program": "",
    } | row
    return Example("x", prefix, prefix, 15, row)


def test_search_finds_a_scene_and_is_not_told_the_truth():
    """Wrong values planted where the truth is change nothing; nor does repetition."""
    truth = example(world("ball", "still"))
    planted = example(world("jet"), program="raise SystemExit")
    planted = dataclasses.replace(planted, prefix=truth.prefix)
    search = predictor_named("search", {"runs": 2, "candidates": 1})
    (found,), (again,) = (search.predict(task_of(e)) for e in (truth, planted))
    assert found == again
    assert isinstance(found, SceneText)
    kinds = [o.object_type for o in Scene.from_yaml(found.text).objects]
    assert kinds == ["static_collider", "dynamic_body"]


@pytest.mark.slow
def test_what_a_regime_tells_is_kept():
    scene = world("ball", "still")
    known = {
        "no_materials": ("shape", "initial_state"),
        "no_positions": ("physics_properties",),
        "full_config": ("shape", "physics_properties", "initial_state"),
    }
    for regime, keys in known.items():
        told = dataclasses.replace(example(scene), regime=REGIMES[regime])
        search = predictor_named("search", {"runs": 2, "candidates": 1})
        (answer,) = search.predict(task_of(told))
        body = Scene.from_yaml(answer.text).to_data()["objects"][0]
        truth = scene.to_data()["objects"][0]
        assert {k: body[k] for k in keys} == {k: truth[k] for k in keys}, regime
        assert body["shape"]["center"] == pytest.approx([0.3, 0.55], abs=1e-3)


@pytest.mark.parametrize("regime", REGIMES)
def test_every_regime_is_read(regime):
    for scene in load_seeds().values():
        told = read_side(REGIMES[regime].tell(scene))
        assert len(told.objects) == (
            0 if regime == "frames_only" else len(scene.objects)
        )
        for known, truth in zip(told.objects, scene.objects, strict=False):
            whole = over(known, truth.model_dump(mode="json"))
            assert known["object_type"] == truth.object_type
            assert known["shape"]["type"] == truth.shape.type
            assert whole["visualization"]["color"] == truth.visualization.color


def test_side_information_of_no_regime_is_refused():
    with pytest.raises(ValueError, match="neither a scene nor a caption"):
        read_side("A ball falls")


def test_scenes_that_are_a_little_off_are_repaired():
    data = world("brick", "still", "jet").to_data()
    data["objects"][0]["shape"]["center"] = [0.31, 0.2]  # into what it lies on
    data["objects"][1]["shape"]["center"] = [0.085, 0.15]  # into a wall
    data["objects"][2]["emission"]["rate"] *= 1.2  # denser than its material
    with pytest.raises(ValueError, match="objects"):
        Scene.from_data(data)
    fixed = Scene.from_yaml(written(data)).to_data()
    for one, other in zip(fixed["objects"], data["objects"], strict=True):
        assert one["shape"]["center"] == pytest.approx(
            other["shape"]["center"], abs=0.02
        )


def test_a_nozzle_steps_back_from_what_it_would_pour_on():
    data = world("still", "rain").to_data()
    still, rain = data["objects"]
    still["shape"] = {"type": "box", "center": [0.4, 0.6], "size": [0.08, 0.4]}
    rain["shape"]["center"] = [0.5, 0.812]  # its lower edge is below the box's upper
    with pytest.raises(ValueError, match="overlaps"):
        Scene.from_data(data)
    fixed = Scene.from_yaml(written(data)).to_data()["objects"][1]
    assert fixed["shape"]["center"] == pytest.approx([0.5, 0.82], abs=0.01)
    assert fixed["shape"]["size"][0] == pytest.approx(0.3, rel=0.05)
    assert fixed["emission"]["rate"] == rain["emission"]["rate"]


def test_a_nozzle_far_outside_is_brought_in():
    data = world("still", "rain").to_data()
    data["objects"][1]["shape"]["center"] = [1.2, 1.28]
    fixed = Scene.from_yaml(written(data)).to_data()["objects"][1]
    assert min(fixed["shape"]["center"]) > 0.7
    assert fixed["shape"]["size"][0] > 0.1


def test_a_nozzle_between_things_becomes_narrower():
    data = world("still", "rain").to_data()
    box = {"type": "box", "center": [0.8, 0.8], "size": [0.2, 0.3]}
    data["objects"][0]["shape"] = box
    with pytest.raises(ValueError, match="overlaps"):
        Scene.from_data(data)  # it reaches .05 m into a box that is .15 m high
    fixed = Scene.from_yaml(written(data)).to_data()["objects"][1]
    assert fixed["shape"]["center"][0] == pytest.approx(0.6, abs=0.01)
    assert 0.15 < fixed["shape"]["size"][0] < 0.21


def test_scenes_that_are_far_off_are_not():
    data = world("brick", "still").to_data()
    data["objects"][1]["visualization"]["color"] = "#F45F2D"  # too near to the other
    with pytest.raises(ValueError, match="rule of colors"):
        repaired(data)


@pytest.mark.parametrize(
    "prefix",
    [
        np.zeros((38, 256, 256, 3), np.uint8),
        np.zeros((0, 256, 256, 3), np.uint8),
        np.zeros((38, 256, 128, 3), np.uint8),
        np.full((1, 256, 256, 3), 150, np.uint8),
    ],
    ids=["black", "empty", "wide", "full"],
)
def test_what_cannot_be_searched_is_a_failure_that_says_why(prefix):
    task = Task("x", prefix, "", "frames_only", 112, 15, FORM)
    (answer,) = predictor_named("search", {"runs": 1}).predict(task)
    assert isinstance(answer, Failure)
    assert (answer.outcome, bool(answer.reason)) == ("no_scene", True)


def test_a_budget_of_nothing_is_refused():
    for name, value in (("runs", 0), ("minutes", 0.0), ("candidates", 0)):
        with pytest.raises(ValueError, match="must be positive"):
            predictor_named("search", {name: value})


def rosenbrock(x):
    return float((100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum())


def test_minimisers_find_the_bottom_of_a_curved_valley():
    found = descend(rosenbrock, [-1.0, 1.0], [0.5, 0.5], 400)
    assert found[1] == pytest.approx([1.0, 1.0], abs=0.01)
    found = evolve(rosenbrock, [-1.0] * 4, [0.5] * 4, 3000, seed=2)
    assert found[1] == pytest.approx([1.0] * 4, abs=0.01)
    again = evolve(rosenbrock, [-1.0] * 4, [0.5] * 4, 3000, seed=2)
    assert all(itertools.starmap(np.array_equal, zip(found, again, strict=True)))


def test_the_table_of_the_train_split_has_every_class():
    table = prior()
    assert table.materials.keys() == MATERIALS.keys()
    assert sum(m["share"] for m in table.materials.values()) == pytest.approx(
        1, abs=0.01
    )
    assert yaml.safe_dump(table.typical("snow"))
    assert FRAMES == 38


def test_a_colour_is_judged_by_frames_until_others_interfere():
    frames = prefix_of(world("brick", "ball"))
    labels = labels_of(frames)
    spoilt = frames.copy()
    spoilt[20:] = 0
    losses, whole = Reference(labels).losses(spoilt), Reference(labels).losses(frames)
    for color in labels.colors:
        assert losses.until(color, 20, 9.0) == 0.0
        assert losses.until(color, FRAMES, 9.0) == pytest.approx(18 / FRAMES)
        assert whole.until(color, FRAMES, 9.0) == 0.0
    assert losses.until("#123456", FRAMES, 9.0) == 9.0
