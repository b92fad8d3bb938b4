"""Lists take samples that move and are no chaos; what was passed over is recorded."""

import dataclasses

import pytest

from mpmworlds.builder.plan import evaluation
from mpmworlds.builder.plan.candidates import seed
from mpmworlds.builder.plan.evaluation import (
    Measured,
    measure,
    measure_lists,
    passed_over,
    read_measured,
    with_measured,
)
from mpmworlds.builder.plan.families import row_of
from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.render.executors import Executor, open_executor
from mpmworlds.metrics import SCORED
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.assign import SplitParams
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.lists import EVALUATION, ListParams, compute_lists
from tests.builder.plan.plans import SMALL
from tests.made_up import rows as made_up_rows
from tests.sim.scenes import BODY, scene_data

GOOD = Measured("", "", "ok", motion=0.3, ceiling={"mask_iou": 0.8})
SPLIT = SplitParams("test", 0.4, 0.5)
LISTS = ListParams(
    salt="a",
    evaluation={"test": 5, "modification_validation": 3},
    weights={"seed": 8, "parent": 8, "child": 4, "perturbation": 1},
    subsets={},
)


@pytest.mark.parametrize(
    ("found", "fault"),
    [
        ({}, None),
        ({"motion": 0.05, "ceiling": {"mask_iou": 0.5}}, None),
        ({"status": "crash"}, "crash"),
        ({"motion": 0.049}, "hardly_moves"),
        ({"motion": 0.049, "ceiling": None}, "hardly_moves"),
        ({"ceiling": {"mask_iou": 0.49}}, "chaotic"),
    ],
)
def test_a_sample_that_rests_or_is_chaos_is_passed_over(found, fault):
    assert dataclasses.replace(GOOD, **found).fault == fault


# ---- lists, with made-up measurements


def made_up(row):
    """A third of all samples rest, and some are chaos."""
    number = int(row.scene_sha256[:6], 16)
    motion = 0.0 if number % 3 == 0 else 0.2
    ceiling = 0.3 if number % 5 == 0 else 0.9
    scores = dict.fromkeys(SCORED, 0.0) | {"mask_iou": ceiling}
    return Measured(row.id, row.program_sha256, "ok", motion, scores)


class Here(Executor):
    """An executor that does the work in this process."""

    slots = 2

    def __init__(self, function):
        self.function, self.tasks = function, []

    def submit(self, task):
        self.tasks.append(task)

    def wait(self, timeout=None):
        done = [(task, self.function(task)) for task in self.tasks]
        self.tasks = []
        return done

    def close(self):
        """Leave nothing behind: there is no process."""


@pytest.fixture
def rows():
    """Forty parents with a child each; their hashes tell what is made up of them."""
    (row, *_) = made_up_rows()
    names = [f"p{n:04d}{end}" for n in range(40) for end in ("", "-c0")]
    return [
        dataclasses.replace(row, id=name, scene_sha256=text_sha256(name))
        for name in names
    ]


@pytest.fixture
def here(monkeypatch):
    """Measurements that are made up, counted by id."""
    measured = []

    def opened(function, workers, ray):
        assert function is measure

        def counted(row):
            measured.append(row.id)
            return made_up(row)

        return Here(counted)

    monkeypatch.setattr(evaluation, "open_executor", opened)
    return measured


def test_lists_are_the_first_samples_that_are_worth_it(rows, here, tmp_path):
    found = measure_lists(rows, SPLIT, LISTS, tmp_path / "m.parquet")
    assert read_measured(tmp_path / "m.parquet") == found
    assert sorted(here) == [m.id for m in found]
    over = passed_over(found)
    assert over
    ids = [row.id for row in rows]
    lists = compute_lists(ids, SPLIT, LISTS, over)
    by_id = {row.id: row for row in rows}
    for split, name in EVALUATION.items():
        assert len(lists[name]) == LISTS.evaluation[split]
        assert all(made_up(by_id[i]).fault is None for i in lists[name])
        assert set(lists[name]) <= set(here)
    everyone = {row.id for row in rows if made_up(row).fault}
    assert lists == compute_lists(ids, SPLIT, LISTS, everyone)


def test_what_was_measured_is_not_measured_again(rows, here, tmp_path):
    first = measure_lists(rows, SPLIT, LISTS, tmp_path / "m.parquet")
    bytes_ = (tmp_path / "m.parquet").read_bytes()
    here.clear()
    assert measure_lists(rows, SPLIT, LISTS, tmp_path / "m.parquet") == first
    assert here == []
    lines = (tmp_path / "m.jsonl").read_text().splitlines(keepends=True)
    (tmp_path / "m.jsonl").write_text("".join(lines[:-2]) + lines[-2][:20])
    assert measure_lists(rows, SPLIT, LISTS, tmp_path / "m.parquet") == first
    assert len(here) == 2
    assert (tmp_path / "m.parquet").read_bytes() == bytes_


def test_a_sample_whose_program_has_changed_is_measured_again(rows, here, tmp_path):
    first = measure_lists(rows, SPLIT, LISTS, tmp_path / "m.parquet")
    changed = first[0].id
    other = [
        dataclasses.replace(row, program_sha256="0" * 64) if row.id == changed else row
        for row in rows
    ]
    here.clear()
    measure_lists(other, SPLIT, LISTS, tmp_path / "m.parquet")
    assert here == [changed]


def test_too_few_samples_are_named(rows, here, tmp_path):
    greedy = dataclasses.replace(LISTS, evaluation={"test": 500})
    with pytest.raises(
        ValueError, match=r"split 'test': \d+ samples too few that move"
    ):
        measure_lists(rows, SPLIT, greedy, tmp_path / "m.parquet")


def test_rows_get_what_was_measured_of_them(rows):
    one, other = rows[:2]
    found = [dataclasses.replace(made_up(one)), dataclasses.replace(GOOD, id=other.id)]
    first, second, *rest = with_measured(rows, found)
    assert (first.motion, first.ceiling) == (found[0].motion, found[0].ceiling)
    assert second == other  # it was measured with another program
    assert rest == rows[2:]


# ---- real runs


AS_IT_IS = dataclasses.replace(
    SMALL, grid_resolution=32, resolution=64, duration_frames=180
)


def row(*things, gravity=(0.0, -9.8)):
    """Row of a scene of six seconds."""
    scene = Scene.from_data(scene_data(*things, gravity=gravity, frames=180))
    return row_of(seed(AS_IT_IS, SampleId("s00"), "s00_made", scene), AS_IT_IS)


@pytest.mark.slow
def test_a_body_at_rest_is_run_once_and_one_that_glides_moves():
    rests = measure(row(BODY, gravity=(0.0, 0.0)))
    assert (rests.status, rests.fault) == ("ok", "hardly_moves")
    assert rests.ceiling is None
    glides = BODY | {"initial_state": {"velocity": [0.1, 0.03]}}
    moves = measure(row(glides, gravity=(0.0, 0.0)))
    assert moves.fault is None
    assert moves.motion > 0.1
    assert list(moves.ceiling) == list(SCORED)
    assert moves.ceiling["mask_iou"] > 0.95
    assert moves.ceiling["semd"] < 0.01


@pytest.mark.slow
def test_it_is_the_same_in_another_process():
    sample = row(BODY)
    with open_executor(measure, 2, None) as executor:
        executor.submit(sample)
        ((_, found),) = executor.wait(None)
    assert found == measure(sample)
