"""Every way to call load_dataset that the documentation names, on a built release.

Each group runs in a process of its own: what ``datasets`` reads from the environment,
and whether it has been imported yet, is part of what is tested.
"""

import json
import os
import shutil
import subprocess
import sys
import textwrap

import pytest

TRAIN = ["p0000", "p0000-c0", "p0000-c0-n00", "p0001", "p0001-n00"]


@pytest.fixture
def python(tmp_path):
    """Function that runs statements and returns what they leave in ``found``."""

    def run(statements, cwd=tmp_path, **environment):
        settings = {
            "HF_HOME": str(tmp_path / "hf"),
            "XDG_CACHE_HOME": str(tmp_path / "cache"),
            "HF_HUB_OFFLINE": "1",
            "HF_HUB_DISABLE_TELEMETRY": "1",
        }
        inherited = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("HF_", "MPMWORLDS_"))
        }
        code = "import json\nfound = {}\n" + textwrap.dedent(statements)
        done = subprocess.run(
            [sys.executable, "-c", code + "\nprint('\\n' + json.dumps(found))"],
            cwd=cwd,
            env=inherited | settings | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run


FORMS = """
from mpmworlds.loaders.alias import install
install()
install()
from datasets import get_dataset_config_names, get_dataset_split_names
from datasets import load_dataset, load_dataset_builder
ids = lambda rows: [row["id"] for row in rows]
found["default"] = {split: ids(rows) for split, rows in load_dataset(NAME).items()}
found["slice"] = ids(load_dataset(NAME, "tiny", split="train[1:3]"))
found["percent"] = ids(load_dataset(NAME, "tiny", split="train[:40%]"))
found["sum"] = ids(load_dataset(NAME, "mini", split="train+test"))
found["columns"] = load_dataset(NAME, "mini", split="test").select_columns(
    ["id", "num_frames"])[0]
found["recipes"] = load_dataset(NAME, "recipes", split="test").column_names[:3]
found["configs"] = sorted(get_dataset_config_names(NAME))
found["splits"] = get_dataset_split_names(NAME, "mini")
found["version"] = str(load_dataset_builder(NAME, "tiny").info.version)
found["stream"] = ids(load_dataset(NAME, "tiny", split="train", streaming=True).skip(3))
found["processes"] = ids(load_dataset(NAME, "tiny", split="train", num_proc=2))
found["video"] = len(load_dataset(NAME, "tiny", split="test")[1]["video"]["bytes"]) > 99
"""

EXPECTED = {
    "default": {
        "train": TRAIN,
        "modification_validation": ["p0000-c1"],
        "test": ["p0002", "p0002-n00"],
    },
    "slice": TRAIN[1:3],
    "percent": TRAIN[:2],
    "sum": ["p0000", "p0002"],
    "columns": {"id": "p0002", "num_frames": 8},
    "recipes": ["id", "kind", "parent_id"],
    "configs": ["mini", "recipes", "tiny"],
    "splits": ["train", "test"],
    "version": "1.2.3",
    "stream": TRAIN[3:],
    "processes": TRAIN,
    "video": True,
}


def test_the_bare_name_finds_the_release_in_the_variable(python, release):
    found = python("NAME = 'mpmworlds'" + FORMS, MPMWORLDS_RELEASE=str(release))
    assert found == EXPECTED


def test_a_folder_is_loaded_by_relative_and_absolute_path(python, release):
    statements = """
    from datasets import load_dataset
    from mpmworlds.loaders.alias import install
    install()  # after the import of datasets
    for name in ("./mpmworlds", "mpmworlds", PATH):
        found[name] = list(load_dataset(name, "mini", split="test")["id"])
    """
    code = f"PATH = {str(release)!r}\n" + textwrap.dedent(statements)
    found = python(code, cwd=release.parent)
    assert set(found) == {"./mpmworlds", "mpmworlds", str(release)}
    assert list(found.values()) == [["p0002"]] * 3


def test_a_release_in_the_usual_place_is_found(python, release, tmp_path):
    (tmp_path / "release").mkdir()
    (tmp_path / "release" / "mpmworlds").symlink_to(release)
    statements = """
    from mpmworlds.loaders.alias import install
    install()
    import datasets
    found["ids"] = list(datasets.load_dataset("mpmworlds", "mini", split="test")["id"])
    """
    assert python(statements) == {"ids": ["p0002"]}


def test_the_hub_repository_is_loaded_whole_streamed_and_by_revision(python, hub):
    statements = """
    from datasets import load_dataset
    from huggingface_hub.errors import HfHubHTTPError
    name = "acme/mpmworlds"
    found["test"] = list(load_dataset(name, "tiny", split="test")["id"])
    rows = load_dataset(name, "mini", split="test", revision="v1.2.3")
    found["tag"] = list(rows["id"])
    rows = load_dataset(name, "tiny", split="train", streaming=True)
    found["stream"] = [row["id"] for row in rows.select_columns(["id"])]
    try:
        load_dataset(name, "mini", revision="v9")
    except Exception as error:
        found["error"] = type(error).__name__
    """
    found = python(statements, HF_ENDPOINT=hub.url, HF_HUB_OFFLINE="0")
    assert found == {
        "test": ["p0002", "p0002-n00"],
        "tag": ["p0002"],
        "stream": TRAIN,
        "error": "DatasetNotFoundError",
    }


def test_the_bare_name_falls_back_to_the_hub(python, hub):
    statements = """
    import mpmworlds.loaders.locate as locate
    from mpmworlds.loaders.alias import install
    install()
    found["repository"] = locate.resolve()
    locate.HUB_REPOSITORY = "acme/mpmworlds"
    from datasets import load_dataset
    found["ids"] = list(load_dataset("mpmworlds", "mini", split="test")["id"])
    """
    found = python(statements, HF_ENDPOINT=hub.url, HF_HUB_OFFLINE="0")
    assert found == {"repository": "mpmworlds/mpmworlds", "ids": ["p0002"]}


def test_a_revision_of_the_bare_name_is_one_of_the_hub(python, hub, release):
    statements = """
    import mpmworlds.loaders.locate as locate
    from mpmworlds.loaders.alias import install
    install()
    locate.HUB_REPOSITORY = "acme/mpmworlds"
    from datasets import load_dataset
    rows = load_dataset("mpmworlds", "mini", split="test", revision="v1.2.3")
    found["ids"] = list(rows["id"])
    """
    hub.requests.clear()
    environment = {"HF_ENDPOINT": hub.url, "HF_HUB_OFFLINE": "0"}
    found = python(statements, MPMWORLDS_RELEASE=str(release), **environment)
    assert found == {"ids": ["p0002"]}
    assert any("v1.2.3" in path for _, path in hub.requests)


def test_damage_is_an_error_where_datasets_alone_would_load_it(
    python, release, tmp_path
):
    copy = shutil.copytree(release, tmp_path / "mpmworlds")
    path = copy / "data/mini/test-00000-of-00001.arrow"
    data = bytearray(path.read_bytes())
    data[data.find(b"mdat") + 40] ^= 1
    path.write_bytes(data)
    statements = """
    from datasets import load_dataset
    found["rows"] = len(load_dataset("./mpmworlds", "mini", split="test"))
    from mpmworlds.loaders.alias import install
    install()
    try:
        load_dataset("mpmworlds", "mini", split="test")
    except ValueError as error:
        found["error"] = str(error)
    """
    found = python(statements)
    assert found["rows"] == 1
    assert "data/mini/test-00000-of-00001.arrow: the bytes of p0002" in found["error"]
    assert "fetch or build the release again" in found["error"]


def test_installing_imports_nothing_heavy(python):
    statements = """
    import sys
    from mpmworlds.loaders.alias import install
    install()
    heavy = {"datasets", "pyarrow", "numpy", "cv2", "av", "torch", "taichi", "pydantic"}
    found["heavy"] = sorted(heavy & set(sys.modules))
    """
    assert python(statements) == {"heavy": []}


def test_other_names_reach_datasets_unchanged(python):
    statements = """
    from mpmworlds.loaders.alias import install
    install()
    import datasets, datasets.load, inspect
    found["file"] = inspect.getsourcefile(datasets.load).endswith("load.py")
    found["loader"] = type(datasets.load.__loader__).__name__
    open("rows.csv", "w").write("a,b\\n1,2\\n")
    rows = datasets.load_dataset("csv", data_files="rows.csv", split="train")
    found["row"] = rows[0]
    try:
        datasets.load_dataset("mpmworlds/other")
    except Exception as error:
        found["error"] = type(error).__name__
    """
    assert python(statements) == {
        "file": True,
        "loader": "SourceFileLoader",
        "row": {"a": 1, "b": 2},
        "error": "ConnectionError",
    }
