"""Statistics are counted from the columns, and held to what the paper publishes."""

import builtins
import json
from collections import Counter
from dataclasses import replace

import pyarrow as pa
import pytest

from mpmworlds.builder.plan.manifest import read_table, write_manifest
from mpmworlds.builder.statistics.counts import (
    COUNTED,
    STRUCTURED,
    count_by_split,
    count_scenes,
    count_structures,
    count_table,
)
from mpmworlds.builder.statistics.figure import write_figure
from mpmworlds.builder.statistics.table import statistics_data, statistics_table
from mpmworlds.builder.statistics.targets import (
    MIX,
    NOT_PUBLISHED,
    TARGETS,
    order_holds,
    verdicts,
)
from mpmworlds.sim.scene.scene import Scene
from tests.made_up import rows

PUBLISHED_ORDER = {
    "elastic": 500,
    "liquid": 480,
    "snow": 200,
    "sand": 100,
    "viscoplastic": 90,
    "rigid": 300,
}


AS_READ = {
    "liquid": 345,
    "elastic/plastic": 327,
    "snow": 202,
    "visco": 55,
    "sand": 70,
    "rigid": 1,
}


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    path = tmp_path_factory.mktemp("statistics") / "manifest.parquet"
    write_manifest(path, rows())
    return path


@pytest.fixture(scope="module")
def found(manifest):
    return count_table(read_table(manifest, COUNTED))


@pytest.fixture(scope="module")
def structures(manifest):
    return count_structures(read_table(manifest, STRUCTURED))


@pytest.fixture
def as_published(found):
    """Return the statistics of a corpus that meets every target exactly."""
    return replace(
        found,
        median_objects=3.0,
        mean_objects=2.9,
        two_materials=0.225,
        three_materials=0.053,
        materials=PUBLISHED_ORDER,
        matter=AS_READ,
    )


def test_columns_and_rows_are_counted_alike(found):
    assert count_scenes(rows()) == found


def test_counts_are_those_of_the_rows(found):
    assert (found.scenes, found.families) == (36, 6)
    assert (found.templates, found.perturbations) == (18, 18)
    assert found.kinds == {"seed": 1, "parent": 5, "child": 12, "perturbation": 18}
    assert found.num_objects == Counter(row.num_objects for row in rows())
    assert list(found.num_objects) == sorted(found.num_objects)
    assert found.materials == Counter(name for row in rows() for name in row.materials)
    assert found.splits == Counter(row.split for row in rows())
    assert found.two_materials == sum(row.num_materials > 1 for row in rows()) / 36
    assert found.edits == {"perturb": 18, "change_gravity": 12, "compose": 5}
    families = Counter(
        thing.physics_properties.FAMILY
        for row in rows()
        if row.kind != "perturbation"
        for thing in Scene.from_yaml(row.scene).objects
        if hasattr(thing, "physics_properties")
    )
    assert found.matter == families
    assert found.share("snow") == families["snow"] / families.total()
    assert found.share("jam") == 0.0


def test_parts_make_up_the_whole(manifest, found):
    parts = count_by_split(read_table(manifest, COUNTED))
    assert list(parts) == ["train", "modification_validation", "test"]
    for name in ("kinds", "materials", "object_types", "edits", "num_objects"):
        total = sum(
            (Counter(getattr(part, name)) for part in parts.values()), Counter()
        )
        assert +total == +Counter(getattr(found, name))


def test_split_without_scenes_has_no_part(manifest):
    table = read_table(manifest, COUNTED)
    train = table.filter(pa.array([row.split == "train" for row in rows()]))
    assert list(count_by_split(train)) == ["train"]


def test_edit_that_names_no_operator_is_an_error():
    with pytest.raises(ValueError, match="must be a JSON object that names its"):
        count_scenes([replace(rows()[0], edit='{"by": "hand"}')])


def test_structures_are_those_of_the_parents(structures):
    assert (structures.parents, structures.distinct) == (5, 5)
    assert structures.commonest_share == pytest.approx(1 / 5)


def test_most_frequent_structure_is_found(tmp_path):
    twice = replace(rows()[0], id="p0009")
    write_manifest(tmp_path / "m.parquet", [*rows(), twice])
    structures = count_structures(read_table(tmp_path / "m.parquet", STRUCTURED))
    assert (structures.parents, structures.distinct) == (6, 5)
    assert structures.commonest_share == pytest.approx(2 / 6)
    assert "liquid" in structures.commonest


def test_corpus_without_parents_has_no_structures(manifest):
    table = read_table(manifest, STRUCTURED).slice(0, 0)
    structures = count_structures(table)
    assert (structures.parents, structures.distinct) == (0, 0)


def test_parent_whose_scene_cannot_be_read_is_an_error(corpus):
    table = read_table(corpus.manifest, STRUCTURED)
    with pytest.raises(ValueError, match="p0000: its scene cannot be read"):
        count_structures(table)


# ---- targets


def test_published_numbers_meet_their_targets(as_published):
    assert all(verdict.holds for verdict in verdicts(as_published))
    assert len(verdicts(as_published)) == len(TARGETS) + len(MIX) + 1


@pytest.mark.parametrize(
    ("change", "broken"),
    [
        ({"median_objects": 4.0}, "objects per scene, median"),
        ({"median_objects": 2.5}, "objects per scene, median"),
        ({"mean_objects": 3.01}, "objects per scene, mean"),
        ({"mean_objects": 2.79}, "objects per scene, mean"),
        ({"two_materials": 0.2405}, "two materials or more"),
        ({"three_materials": 0.0445}, "three materials or more"),
        ({"materials": PUBLISHED_ORDER | {"sand": 201}}, "order of materials"),
        ({"matter": AS_READ | {"sand": 45, "rigid": 26}}, "matter of templates, sand"),
        ({"matter": AS_READ | {"visco": 120}}, "matter of templates, visco"),
    ],
    ids=str,
)
def test_number_too_far_from_the_paper_breaks_its_target(as_published, change, broken):
    failed = [v.what for v in verdicts(replace(as_published, **change)) if not v.holds]
    assert failed == [broken]


@pytest.mark.parametrize(
    "change",
    [
        {"mean_objects": 3.0},
        {"mean_objects": 2.8},
        {"two_materials": 0.24},
        {"two_materials": 0.21},
        {"three_materials": 0.045},
    ],
    ids=str,
)
def test_limits_themselves_are_allowed(as_published, change):
    assert all(verdict.holds for verdict in verdicts(replace(as_published, **change)))


@pytest.mark.parametrize(
    ("change", "holds"),
    [
        ({}, True),
        ({"liquid": 600}, True),
        ({"sand": 80}, True),
        ({"snow": 90}, False),
        ({"snow": 490}, False),
        ({"viscoplastic": 250}, False),
        ({"rigid": 490}, False),
        ({"rigid": 480}, False),
    ],
    ids=str,
)
def test_order_of_materials_is_the_published_one(change, holds):
    assert order_holds(PUBLISHED_ORDER | change) is holds


def test_absent_materials_are_in_no_order():
    assert not order_holds({"liquid": 5})


# ---- table and figure


def test_table_puts_the_paper_beside_the_corpus(found, structures):
    text = statistics_table({"all": found}, structures)
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "scenes 36 95,805" in lines
    assert "templates 18 9,204" in lines
    assert "perturbations 18 86,601" in lines
    assert f"objects per scene, median {found.median_objects:g} 3" in lines
    assert any(line.endswith("22.5%") for line in lines)
    assert "two materials or more: 33.3%, must be 22.5% +- 1.5%: DOES NOT HOLD" in lines
    assert "structures of parents: 5 distinct ones of 5 parents; 20.0% have" in text
    assert NOT_PUBLISHED in text


def test_table_has_a_column_for_each_part(manifest, found, structures):
    parts = count_by_split(read_table(manifest, COUNTED))
    text = statistics_table({"all": found} | parts, structures)
    assert text.split()[:5] == ["all", *parts, "paper"]
    (line,) = [line for line in text.splitlines() if line.startswith("  parent ")]
    assert line.split()[1::2] == ["5", "3", "0", "2"]


def test_data_are_those_of_the_table(found, structures):
    data = json.loads(json.dumps(statistics_data({"all": found}, structures)))
    assert data["statistics"]["all"]["scenes"] == 36
    assert data["structures"]["distinct"] == 5
    assert data["paper"]["templates"] == 9204
    assert [target["holds"] for target in data["targets"]] == [
        verdict.holds for verdict in verdicts(found)
    ]


@pytest.fixture(scope="module")
def figures(found, tmp_path_factory):
    """Return a function: file name -> bytes of the figure."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("figures")

    def draw(name):
        write_figure(found, folder / name)
        return (folder / name).read_bytes()

    return draw


@pytest.mark.parametrize(
    ("name", "start"), [("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a.pdf", b"%PDF")]
)
def test_figure_has_the_same_bytes_every_time(name, start, figures):
    first = figures(name)
    assert first.startswith(start)
    assert figures(f"b{name}") == first
    assert b"Date" not in first


def test_figure_does_not_depend_on_the_caller_s_style(figures):
    import matplotlib as mpl

    before = figures("style.svg")
    with mpl.rc_context({"font.size": 20, "axes.facecolor": "red"}):
        assert figures("style.svg") == before
        assert mpl.rcParams["font.size"] == 20


def test_figure_of_another_format_is_an_error(found, tmp_path):
    with pytest.raises(ValueError, match=r"format '.gif', must be one of .pdf, .png"):
        write_figure(found, tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []


def test_figure_without_matplotlib_says_what_to_install(found, tmp_path, monkeypatch):
    real = builtins.__import__

    def without(name, *others):
        if name.startswith("matplotlib"):
            raise ModuleNotFoundError(name)
        return real(name, *others)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(RuntimeError, match=r"pip install 'mpmworlds\[plots\]'"):
        write_figure(found, tmp_path / "a.png")
