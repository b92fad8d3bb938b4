"""The verbs that plan, split and build a corpus."""

import pytest
import yaml

from mpmworlds.builder.plan.manifest import read_manifest
from mpmworlds.files.checksums import files_below
from mpmworlds.splits.recorded_lists import read_lists
from tests.small import PARAMS


@pytest.fixture
def params(tmp_path):
    """Return a function: changes of the profile and of the rest -> params file."""

    def write(profile=None, **others):
        text = yaml.safe_dump(PARAMS | others)
        data = yaml.safe_load(text)
        data["profiles"]["tiny"] |= profile or {}
        path = tmp_path / "changed.yaml"
        path.write_text(yaml.safe_dump(data))
        return path

    return write


def bytes_below(folder):
    return {name: (folder / name).read_bytes() for name in files_below(folder)}


# ---- plan and splits


def test_plan_writes_the_manifest_and_says_how_many(command, small, tmp_path):
    path = tmp_path / "manifest.parquet"
    status, out, err = command("plan", "--params", small.params, "--out", path)
    assert (status, out) == (0, f"{path}: 2 scenes\n")
    assert "families: 100%" in err
    assert path.read_bytes() == small.manifest.read_bytes()
    assert [(row.id, row.split) for row in read_manifest(path)] == [
        ("p0000", "test"),
        ("s04", "train"),
    ]


@pytest.mark.parametrize("verb", ["plan", "splits"])
def test_unknown_profile_lists_the_profiles(verb, command, params, tmp_path):
    profile = PARAMS["profiles"]["tiny"]
    path = params(profiles={"tiny": profile, "huge": profile})
    place = "--dir" if verb == "splits" else "--out"
    options = ["--params", path, "--config", "grand", place, tmp_path / "out"]
    message = "profile 'grand' is not in params.yaml; it has ['huge', 'tiny']"
    assert command(verb, *options) == (
        2,
        "",
        f"mpmworlds {verb}: {message}\n",
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["grand", "grand-clips"])
def test_unknown_configuration_lists_all_that_can_be_built(command, tmp_path, name):
    status, out, err = command("build", "--config", name, "--out", tmp_path / "out")
    assert (status, out) == (2, "")
    assert f"configuration '{name}'" in err
    for other in ("full", "mini", "10k", "evaluation", "preview", "tiny"):
        assert f"{other}, " in err
    assert "each with -clips behind its name" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parents": "x"}, "parents = 'x', must be a list of mappings such as"),
        ({"children": -1}, "children = -1, must be a whole number >= 0"),
        ({"duration_frames": 0}, "duration_frames = 0, must be a whole number >= 1"),
        ({"seeds": ["s99"]}, "there is no seed 's99'; there are s00, s01"),
        ({"seeds": 4}, "profile 'tiny': seeds = 4, must be a list of ids"),
        ({"split": "salty"}, "profile 'tiny': "),
        ({"split": {"salt": "a"}}, "'test_fraction'"),
        ({"grid_resolution": 7}, "grid_resolution = 7, must be >= 32"),
        ({"colour": "red"}, "unexpected keyword argument 'colour'"),
    ],
    ids=str,
)
def test_impossible_profile_is_wrong_input(change, message, command, params, tmp_path):
    path = tmp_path / "manifest.parquet"
    status, out, err = command("plan", "--params", params(change), "--out", path)
    assert (status, out) == (2, "")
    assert message in err
    assert not path.exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("profiles: [", "is not YAML"),
        ("- tiny", "must be a mapping with the key 'profiles'"),
        ("profiles: {}", "profile 'tiny' is not in params.yaml; it has []"),
        ("profiles: {tiny: }", "'profiles', a mapping of names to mappings"),
        ("profiles: {tiny: {seeds: []}}", "'children' is missing; add it"),
    ],
)
def test_file_that_is_no_params_is_wrong_input(text, message, command, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text(text)
    status, out, err = command("plan", "--params", path, "--out", tmp_path / "m")
    assert (status, out) == (2, "")
    assert message in err


def test_recorded_splits_pass_their_own_check(command, small, tmp_path):
    options = ["--params", small.params, "--dir", tmp_path / "lists"]
    assert command("splits", *options) == (
        0,
        f"{tmp_path / 'lists'}: train 1, modification_validation 0, test 1\n",
        "",
    )
    sizes = "modification_validation 0, test 1, train 1"
    checked = (0, f"{tmp_path / 'lists'}: {sizes}, as computed\n", "")
    assert command("splits", "--check", *options) == checked
    assert command("splits", "--check", "--manifest", small.manifest, *options) == (
        checked
    )


def test_lists_in_the_package_are_checked_anywhere(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = command("splits", "--check", "--config", "full")
    assert (status, err) == (0, "")
    assert "test 1" in out
    assert out.endswith(", as computed\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("options", [["--params"], ["--config", "grand", "--params"]])
def test_lists_of_other_parameters_are_not_in_the_package(options, command, params):
    path = params(profiles=dict.fromkeys(("tiny", "grand"), PARAMS["profiles"]["tiny"]))
    status, out, err = command("splits", "--check", *options, path)
    assert (status, out) == (2, "")
    assert "--dir: is missing; name the folder of the lists to check" in err


def test_lists_are_written_where_one_says_only(command):
    status, out, err = command("splits", "--config", "tiny")
    assert (status, out) == (2, "")
    assert "--dir: is missing; name the folder to write the lists to" in err


@pytest.mark.parametrize("options", [["splits", "--check", "--dir"], ["verify"]])
def test_folder_without_checksums_is_named(options, command, tmp_path):
    status, out, err = command(*options, tmp_path)
    assert (status, out) == (2, "")
    assert f"{tmp_path / 'SHA256SUMS'}: is not there; name a folder that was" in err


@pytest.mark.parametrize(
    ("verb", "options"),
    [("plan", ["--out", "m"]), ("splits", ["--check"]), ("stats", []), ("audit", [])],
)
def test_verbs_of_whole_profiles_refuse_a_subset(verb, options, command):
    status, out, err = command(verb, "--config", "10k", *options)
    assert (status, out) == (2, "")
    assert "--config 10k: is a subset of 'full'" in err
    assert err.endswith("say --config full\n")


@pytest.mark.parametrize("profiles", [3, [1], {"tiny": 3}, None])
def test_profiles_that_are_none_are_wrong_input(profiles, command, params, tmp_path):
    path = params()
    path.write_text(yaml.safe_dump({"profiles": profiles}))
    status, out, err = command("plan", "--params", path, "--out", tmp_path / "m")
    assert (status, out) == (2, "")
    assert f"{path}: must be a mapping with the key 'profiles', a mapping of" in err


LISTS = {
    "salt": "small",
    "evaluation": {"test": 1},
    "weights": {"seed": 8, "parent": 8, "child": 4, "perturbation": 1},
    "subsets": {"mini": {"train": 1}},
}


def test_lists_that_the_profile_asks_for_are_recorded_and_checked(
    command, params, tmp_path
):
    lists = tmp_path / "lists"
    options = ["--params", params({"lists": LISTS}), "--dir", lists]
    status, out, _ = command("splits", *options)
    assert status == 0
    assert "evaluation_test 1, evaluation_modification 0, mini_train 1" in out
    assert (lists / "mini_train.txt").read_text() == "s04\n"
    status, out, _ = command("splits", "--check", *options)
    assert status == 0
    assert out.endswith("train 1, as computed\n")
    (lists / "mini_train.txt").write_text("p0000\n")
    status, out, _ = command("splits", "--check", *options)
    assert status == 1
    assert "p0000: recorded in mini_train, not chosen" in out.splitlines()


def test_more_samples_than_there_are_is_wrong_input(command, params, tmp_path):
    lists = LISTS | {"evaluation": {"test": 2}}
    options = ["--params", params({"lists": lists}), "--dir", tmp_path / "lists"]
    status, out, err = command("splits", *options)
    assert (status, out) == (2, "")
    assert "list 'evaluation_test': sample of n = 2, must be in [0, 1]" in err
    assert not (tmp_path / "lists").exists()


def test_moved_id_fails_the_check_and_is_named(command, small, tmp_path):
    lists = tmp_path / "lists"
    options = ["--params", small.params, "--dir", lists]
    command("splits", *options)
    (lists / "train.txt").write_text("p0000\ns04\n")
    (lists / "test.txt").write_text("")
    before = bytes_below(lists)
    status, out, _ = command("splits", "--check", *options)
    assert status == 1
    assert "p0000: recorded in train, belongs to test" in out.splitlines()
    assert f"{lists / 'train.txt'}: sha256 " in out
    assert bytes_below(lists) == before


# ---- build


def test_first_build_renders_every_scene(small):
    assert small.stdout == f"{small.release}: 4 shards\n"
    assert f"{small.store}: 2 rendered, 0 there before, 0 failed" in small.stderr
    assert "materialise: 100%" in small.stderr
    assert "build: 100%" in small.stderr


def test_second_build_renders_nothing_and_gives_the_same_bytes(
    command, small, tmp_path
):
    out = tmp_path / "mpmworlds"
    status, _, err = command(
        *("build", "--params", small.params, "--manifest", small.manifest),
        *("--store", small.store, "--out", out),
    )
    assert status == 0
    assert f"{small.store}: 0 rendered, 2 there before, 0 failed" in err
    assert bytes_below(out) == bytes_below(small.release)


def test_a_build_of_a_subset_brings_all_lists_of_the_corpus(
    command, small, params, tmp_path
):
    lists = {
        "salt": "l",
        "evaluation": {"test": 1},
        "weights": {"seed": 1, "parent": 1, "child": 1, "perturbation": 1},
        "subsets": {"few": {"train": 1}},
    }
    out = tmp_path / "mpmworlds"
    status, printed, err = command(
        *("build", "--params", params({"lists": lists}), "--config", "few"),
        *("--manifest", small.manifest, "--store", small.store, "--out", out),
    )
    assert (status, printed) == (0, f"{out}: 3 shards\n"), err
    assert read_lists(out / "splits") == {
        "evaluation_modification": [],
        "evaluation_test": ["p0000"],
        "few_modification_validation": [],
        "few_test": [],
        "few_train": ["s04"],
        "modification_validation": [],
        "test": ["p0000"],
        "train": ["s04"],
    }
    folders = sorted(path.parent.name for path in out.glob("data/*/*-*.arrow"))
    assert folders == ["few", "recipes", "recipes"]
    card = (out / "README.md").read_text()
    assert "| `few_train` | 1 | 1 | 0 | 0 |" in card
    assert 'load_dataset("mpmworlds", "few", split="train")' in card
    assert command("verify", out, "--resimulate", 0)[0] == 0


def test_build_leaves_a_folder_of_something_else_alone(command, small, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    status, out, err = command(
        *("build", "--params", small.params, "--manifest", small.manifest),
        *("--store", small.store, "--out", tmp_path),
    )
    assert (status, out) == (2, "")
    assert f"{tmp_path}: holds 'thesis.tex', which is no part of a release" in err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"version": 1}, "version = 1, must be of type str"),
        (
            {"profile": {"rows_per_shard": "x"}},
            "params.yaml: profile 'tiny': rows_per_shard = 'x', must be of type int",
        ),
        ({"profile": {"rows_per_shard": 0}}, "rows_per_shard = 0, must be at least 1"),
    ],
    ids=str,
)
def test_impossible_setting_builds_nothing(
    setting, message, command, params, small, tmp_path
):
    status, out, err = command(
        *("build", "--params", params(**setting), "--manifest", small.manifest),
        *("--store", small.store, "--out", tmp_path / "release"),
    )
    assert (status, out) == (2, "")
    assert message in err
    assert not (tmp_path / "release").exists()
