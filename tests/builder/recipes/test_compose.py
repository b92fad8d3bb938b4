"""A composed scene is as was drawn, and of the objects that its record says."""

import copy
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

from mpmworlds.builder.recipes.colors import LEAST_HUE_STEP, VIVID
from mpmworlds.builder.recipes.compose import compose, draw_counts
from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.recipes.tables import first_tables
from mpmworlds.sim.scene.palette import PALETTE, hue_difference
from mpmworlds.sim.scene.scene import Scene, SceneError
from tests.sim.scenes import seeds_data

TABLES = first_tables()
COUNTS = [(1, 1), (2, 1), (2, 2), (3, 1), (3, 2), (4, 1), (5, 2), (4, 3), (5, 4)]
MOST_DRAWS = 400


def composed(seed, counts):
    """Scene and record of the first valid draw."""
    rng = np.random.default_rng(seed)
    for _ in range(MOST_DRAWS):
        try:
            data, record = compose(rng, TABLES, seeds_data(), *counts)
            return Scene.from_data(data), record
        except (SceneError, NoRoomError):
            continue
    pytest.fail(f"no draw of {counts} is a valid scene")


@pytest.fixture(scope="module")
def parents():
    """Scenes and records by how many objects and materials they were to have."""
    return {counts: composed(n, counts) for n, counts in enumerate(COUNTS)}


def test_objects_and_materials_are_as_many_as_asked_for(parents):
    for (count, kinds), (scene, _) in parents.items():
        assert len(scene.objects) == count
        assert len(scene.materials) == kinds


def test_objects_come_from_where_the_record_says(parents):
    for scene, record in parents.values():
        assert record["operator"] == "compose"
        assert len(record["seeds"]) in (1, 2, 3)
        assert set(record["seeds"][1:]) <= {name for name, _ in record["objects"]}
        for thing, (name, number) in zip(scene.objects, record["objects"], strict=True):
            assert name in record["seeds"]
            origin = seeds_data()[name]["objects"][number]
            assert thing.shape.type == origin["shape"]["type"]
            types = {thing.object_type, origin["object_type"]}
            assert len(types) == 1 or types == {"static_collider", "kinematic_collider"}


def test_objects_that_are_kept_stay_where_they_are_or_in_its_mirror_image(parents):
    for (count, _), (scene, record) in parents.items():
        first, kept = record["seeds"][0], record["kept"]
        assert 1 <= kept < count or (kept, count) == (0, 1)
        for thing, (name, number) in zip(
            scene.objects[:kept], record["objects"], strict=False
        ):
            assert name == first
            x, y = seeds_data()[name]["objects"][number]["shape"]["center"]
            expected = (1.0 - x if record["mirrored"] else x, y)
            assert thing.shape.center == pytest.approx(expected, abs=1e-3)
        if count > 1:
            assert first not in {name for name, _ in record["objects"][kept:]}


def test_surroundings_are_those_of_the_first_seed_but_for_gravity_and_contact(parents):
    for scene, record in parents.values():
        data, first = scene.to_data(), seeds_data()[record["seeds"][0]]
        for one in (data, first := copy.deepcopy(first)):
            del one["objects"], one["environment"]["gravity"], one["simulation"]["seed"]
            del one["environment"]["walls"]["contact"]
        assert data == first


def test_colours_are_hues_of_their_own_and_grey_is_for_obstacles(parents):
    for scene, _ in parents.values():
        hued = []
        for thing in scene.objects:
            if thing.visualization.color == PALETTE["grey"]:
                assert thing.object_type == "static_collider"
            else:
                hued.append(thing.visualization.color)
        assert set(hued) <= set(VIVID)
        for one, other in combinations(hued, 2):
            assert hue_difference(one, other) > LEAST_HUE_STEP


def test_names_are_neutral_and_in_order(parents):
    for (count, _), (scene, _) in parents.items():
        assert [t.name for t in scene.objects] == [f"object_{i}" for i in range(count)]


def test_what_is_composed_follows_from_the_generator_alone(parents):
    before = copy.deepcopy(seeds_data())
    assert composed(3, COUNTS[3]) == parents[COUNTS[3]]
    assert composed(99, COUNTS[3])[0] != parents[COUNTS[3]][0]
    assert seeds_data() == before


def test_seeds_with_too_few_objects_leave_no_room():
    alone = {
        name: data | {"objects": data["objects"][:1]}
        for name, data in list(seeds_data().items())[:4]
    }
    for seed in range(8):
        with pytest.raises(NoRoomError, match="too few objects"):
            compose(np.random.default_rng(seed), TABLES, alone, 5, 1)


def test_counts_are_drawn_by_their_shares():
    rng = np.random.default_rng(0)
    drawn = [draw_counts(rng, TABLES) for _ in range(4000)]
    assert all(objects >= kinds for objects, kinds in drawn)
    for shares, found in (
        (TABLES.materials_per_scene, Counter(kinds for _, kinds in drawn)),
        (TABLES.objects, Counter(objects for objects, _ in drawn)),
    ):
        assert sum(shares.values()) == pytest.approx(1.0)
        for number, share in shares.items():
            # a scene of more materials than objects drawn gets as many objects
            assert found[int(number)] / len(drawn) == pytest.approx(share, abs=0.05)
