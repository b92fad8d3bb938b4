"""What differs between two scenes is told number by number."""

import json

import pytest

from mpmworlds.baselines.search.differences import differences
from tests.baselines.search.worlds import checked, world


def test_a_scene_does_not_differ_from_itself_in_another_order():
    scene = world("brick", "jet", "fan")
    data = scene.to_data()
    data["objects"].reverse()
    for number, thing in enumerate(data["objects"]):
        thing["name"] = f"another_{number}"
    assert list(differences(scene, checked(data))) == []


def test_each_difference_is_told_with_both_values():
    scene = world("brick", "jet")
    data = scene.to_data()
    data["environment"]["gravity"] = [0.0, -5.0]
    data["objects"][0]["shape"]["size"] = [0.14, 0.12]
    del data["objects"][1]
    found = [str(one) for one in differences(scene, checked(data))]
    assert [line for line in found if not line.startswith("simulation")] == [
        "environment.gravity: [0, -9.8] -> [0, -5]",
        "red box: shape.size: [0.14, 0.1] -> [0.14, 0.12]",
        "orange box: emitter -> none",
    ]
    back = list(differences(checked(data), scene))
    assert (back[-1].truth, back[-1].found) == (None, "emitter")


def test_the_verb_reads_files_and_samples(command, tmp_path):
    scene = world("brick", "jet")
    data = scene.to_data()
    data["environment"]["gravity"] = [0.0, -5.0]
    one, other = tmp_path / "one.yaml", tmp_path / "other.yaml"
    one.write_text(scene.to_yaml())
    other.write_text(checked(data).to_yaml())
    assert command("compare", one, one)[:2] == (0, "nothing differs\n")
    status, out, _ = command("compare", one, other, "--json")
    assert status == 0
    gravity = {"place": "environment.gravity", "truth": [0.0, -9.8], "found": [0, -5]}
    assert gravity in json.loads(out)
    status, out, _ = command("compare", "p0000", one)
    assert (status, "environment" in out or "box" in out) == (0, True)


@pytest.mark.parametrize("source", ["none.yaml", "p99999"])
def test_the_verb_says_what_is_not_there(source, command):
    status, out, err = command("compare", source, source)
    assert (status, out) == (2, "")
    assert source in err
