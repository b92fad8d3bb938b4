"""Rows are simulated again, confined."""

from dataclasses import asdict

import numpy as np
import pytest

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.release import verify
from mpmworlds.builder.release.features import recipe_features
from mpmworlds.builder.release.verify import verify_release
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import Outcome, run
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene
from tests.builder.release.verify.damage import (
    SAMPLES,
    SCENE,
    TEST,
    TRAIN,
    backwards,
    black,
    changed,
    edit_everywhere,
    findings_of,
    found,
    frames_everywhere,
    rewrite,
    rows_of,
)
from tests.planted import planted


@pytest.mark.parametrize("change", [backwards, black])
def test_frames_that_the_program_does_not_render_are_found(copy, change):
    frames_everywhere(copy, change)
    assert findings_of(copy) == []
    (finding,) = findings_of(copy, resimulate=3)
    assert ": p0001: simulated again, it gives another video here (" in finding


def test_an_old_video_of_another_scene_and_its_program_is_found(copy):
    scene = Scene.from_yaml(SCENE.format(color=PALETTE["green"]))
    text, program = scene.to_yaml(), link(scene)
    changes = {"scene": text, "program": program}
    hashes = {f"{name}_sha256": text_sha256(value) for name, value in changes.items()}
    edit_everywhere(copy, changes | hashes)
    assert findings_of(copy) == []
    (finding,) = findings_of(copy, resimulate=3)
    assert ": p0001: simulated again, it gives another video here (" in finding


def test_rows_are_drawn_by_fresh_randomness_that_can_be_repeated(
    simulated, monkeypatch
):
    failed = Outcome("exception", np.zeros((0, 1, 1, 3), np.uint8), 0.0, "none")
    monkeypatch.setattr(verify, "run", lambda program: failed)
    drawn = [verify_release(simulated, seed=str(seed)) for seed in range(8)]
    assert len({verified.simulated[0].id for verified in drawn}) == len(SAMPLES)
    assert verify_release(simulated, seed="3") == drawn[3]
    (finding,) = drawn[3].findings
    assert "simulated again, it gives another video here (it ends in ex" in str(finding)
    first, second = (verify_release(simulated, resimulate=0) for _ in range(2))
    assert first.seed != second.seed


def test_a_row_with_findings_is_not_simulated_again(copy):
    rewrite(copy, TEST, changed(kind="child"))
    for name in TRAIN:
        with (copy / name).open("ab") as file:
            file.write(b"more")
    verified = verify_release(copy, resimulate=9)
    simulated = {found.path for found in verified.simulated}
    assert not simulated & {TEST, *TRAIN}
    assert verified.findings


@pytest.mark.parametrize("hashes", ["stale sums", "stale", "fixed up", "everywhere"])
def test_a_program_that_was_tampered_with_is_found_and_never_run(
    copy, tmp_path, hashes
):
    mark = tmp_path / "was here"
    sums = (copy / "SHA256SUMS").read_bytes()
    (row,) = rows_of(copy / TEST)
    program = planted(row["program"], mark)
    values = {"program": program}
    if hashes in ("fixed up", "everywhere"):
        values["program_sha256"] = text_sha256(program)
    if hashes == "everywhere":
        edit_everywhere(copy, values)
    else:
        rewrite(copy, TEST, changed(**values))
    if hashes == "stale sums":
        (copy / "SHA256SUMS").write_bytes(sums)
    findings = findings_of(copy, resimulate=9)
    assert found(findings, f"{TEST}: p0001: its ", "program"), findings
    assert not mark.exists()


def test_what_is_planted_into_a_program_would_run(simulated, tmp_path):
    mark = tmp_path / "was here"
    row, *_ = rows_of(simulated / TEST)
    run(planted(row["program"], mark), 1, trusted=True).expect()
    assert mark.exists()


def test_what_is_simulated_is_confined(simulated, monkeypatch):
    given = []

    def watched(program, **options):
        given.append(options)
        return run(program, **options)

    monkeypatch.setattr(verify, "run", watched)
    assert verify_release(simulated).findings == ()
    assert given == [{}]


def test_rows_of_the_manifest_and_of_the_recipes_are_the_same_fields(make_row):
    row = make_row("p0000", "train", "program")
    assert list(asdict(row)) == list(recipe_features())
