"""The command: what every verb shares, and the verbs of scenes and programs."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import cv2
import jsonschema
import numpy as np
import pytest
import yaml

import mpmworlds
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.cli import main
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4, frames_sha256
from mpmworlds.sim.scene.scale import rescale

VERBS = (
    *("schema", "link", "run", "plan", "measure", "splits", "materialise", "build"),
    *("propose", "stats", "audit", "verify", "regenerate", "fetch", "publish"),
    *("export", "gallery", "play"),
    *(
        "infer",
        "compare",
        "train",
        "evaluate",
        "submission",
        "report",
        "gate",
        "doctor",
    ),
)


@pytest.fixture(scope="module")
def scene():
    """A scene of 32 cells, 64 px and 6 frames."""
    return rescale(load_seeds()["s04_bouncing_blocks"], 32, 64, 6)


@pytest.fixture
def scene_file(scene, tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(scene.to_yaml())
    return path


@pytest.fixture
def program_file(make_program, tmp_path):
    """A program without physics: 8 frames of 64 px."""
    path = tmp_path / "program.py"
    path.write_text(make_program(0))
    return path


def process(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "mpmworlds", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
    )


def test_module_is_the_command_and_knows_its_version():
    done = process("--version")
    assert (done.returncode, done.stdout) == (0, f"{mpmworlds.__version__}\n")


@pytest.mark.parametrize("verb", VERBS)
def test_help_of_every_verb_shows_an_example(verb, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit) as exit_:
        main([verb, "--help"])
    assert exit_.value.code == 0
    out = capsys.readouterr().out
    (example,) = re.findall(r"^example: mpmworlds (\w+)", out, re.MULTILINE)
    assert example == verb


def test_help_lists_every_verb(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    listed = re.findall(r"^    (\w+)", capsys.readouterr().out, re.MULTILINE)
    assert listed == list(VERBS)


@pytest.mark.parametrize("arguments", [[], ["paint"], ["link"], ["run", "--frames"]])
def test_wrong_arguments_are_wrong_use(arguments, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    out, err = capsys.readouterr()
    assert (out, err[:17]) == ("", "usage: mpmworlds ")


def test_schema_accepts_a_scene_and_refuses_a_misspelt_one(command, scene):
    status, out, err = command("schema")
    assert (status, err) == (0, "")
    data = yaml.safe_load(scene.to_yaml())
    jsonschema.validate(data, json.loads(out))
    data["simulation"]["seeed"] = data["simulation"].pop("seed")
    with pytest.raises(jsonschema.ValidationError, match="seeed"):
        jsonschema.validate(data, json.loads(out))


def test_link_prints_the_program_that_the_library_links(command, scene, scene_file):
    assert command("link", scene_file) == (0, link(scene), "")


def test_link_writes_the_program_where_it_is_told(command, scene, scene_file, tmp_path):
    path = tmp_path / "new" / "program.py"
    assert command("link", scene_file, "-o", path) == (0, "", "")
    assert path.read_text() == link(scene)


@pytest.mark.parametrize("verb", ["link", "run"])
def test_bad_scene_names_file_object_field_value_and_rule(
    verb, command, scene_file, tmp_path
):
    data = yaml.safe_load(scene_file.read_text())
    data["objects"][1]["physics_properties"]["poissons_ratio"] = 0.7
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(data))
    status, out, err = command(verb, path)
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert line.startswith(f"mpmworlds {verb}: {path}: objects[1] 'object_1': ")
    assert "poissons_ratio = 0.7, must be <" in line


@pytest.mark.parametrize(
    "arguments",
    [
        ["link", "absent"],
        ["run", "absent.py"],
        ["plan", "--params", "absent", "--out", "m"],
        ["splits", "--manifest", "absent", "--dir", "lists"],
        ["splits", "--check", "--dir", "absent"],
        ["materialise", "--manifest", "absent"],
        ["build", "--manifest", "absent", "--out", "r"],
        ["verify", "absent"],
        ["infer", "absent", "--out", "scene.yaml"],
        ["evaluate", "--predictor", "black", "--release", "absent"],
        ["report", "absent", "--out", "report"],
        ["gate", "--fit", "absent", "absent", "--out", "gate"],
    ],
    ids=" ".join,
)
def test_missing_file_is_named_and_nothing_is_written(
    arguments, command, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    status, out, err = command(*arguments)
    assert (status, out) == (2, "")
    assert err.startswith(f"mpmworlds {arguments[0]}: ")
    assert "absent" in err
    assert list(tmp_path.iterdir()) == []


def test_missing_file_gives_no_traceback(tmp_path):
    done = process("run", tmp_path / "absent.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("mpmworlds run: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("name", ["binary.yaml", "binary.py"])
def test_file_that_is_no_text_is_named(name, command, tmp_path):
    (tmp_path / name).write_bytes(b"\xff\xfe")
    status, _, err = command("run", tmp_path / name)
    assert status == 2
    assert f"{tmp_path / name}: is not UTF-8 text" in err


@pytest.mark.slow
def test_run_of_a_scene_writes_its_exact_video(command, scene_file, tmp_path):
    video = tmp_path / "out" / "video.mp4"
    status, out, err = command("run", scene_file, "--out", video, "--json")
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["status"], result["frames"], result["message"]) == ("ok", 6, "")
    frames = decode_mp4(video.read_bytes())
    assert frames.shape == (6, 64, 64, 3)
    assert frames_sha256(frames) == result["frames_sha256"]
    assert len(np.unique(frames[-1].reshape(-1, 3), axis=0)) > 3, "objects are missing"


@pytest.mark.slow
def test_run_writes_states_and_sums_them_up(command, scene_file, tmp_path):
    path = tmp_path / "out" / "states.npz"
    arguments = ["run", scene_file, "--states", path, "--states-dtype", "float16"]
    status, out, err = command(*arguments, "--json")
    assert (status, err) == (0, "")
    told = json.loads(out)["invariants"]
    with np.load(path) as file:
        assert file["positions"].dtype == np.float16
        assert file["positions"].shape == (6, len(file["mass"]), 2)
        names = [name for name in file.files if name.startswith("invariants/")]
        assert {f"invariants/{name}" for name in told} == set(names)
        for name, ends in told.items():
            assert ends["first"] == file[f"invariants/{name}"][0].tolist()
            assert ends["last"] == file[f"invariants/{name}"][-1].tolist()


def test_states_of_a_program_without_any_are_a_typed_outcome(
    command, program_file, tmp_path
):
    video, states = tmp_path / "video.mp4", tmp_path / "states.npz"
    arguments = ["run", program_file, "--out", video, "--states", states]
    status, out, err = command(*arguments)
    assert (status, out.partition(":")[0]) == (1, "no_states")
    assert "the program has no DT, SUBSTEPS at its top" in err
    assert not video.exists()
    assert not states.exists()


def test_run_writes_video_and_sheet_of_a_program(
    command, program_file, run_inline, tmp_path
):
    video, sheet = tmp_path / "video.mp4", tmp_path / "sheet.png"
    status, out, _ = command("run", program_file, "--out", video, "--sheet", sheet)
    assert status == 0
    assert out.startswith("ok: 8 frames, ")
    expected = run_inline(program_file.read_text())
    assert np.array_equal(decode_mp4(video.read_bytes()), expected)
    picture = cv2.imread(str(sheet))
    assert picture.shape == (260, 6 * 260, 3)
    # Frame 0 has its square at rows 20-29 and columns 0-9 of 64, four times enlarged.
    blue, green, red = picture[2 + 100, 2 + 20]
    assert tuple(expected[0, 25, 5]) == (red, green, blue)


def test_framerate_is_that_of_the_video(command, program_file, tmp_path):
    video = tmp_path / "video.mp4"
    assert command("run", program_file, "--out", video, "--framerate", 12)[0] == 0
    assert cv2.VideoCapture(str(video)).get(cv2.CAP_PROP_FPS) == 12


def test_frames_stops_a_program_early(command, program_file):
    status, out, _ = command("run", program_file, "--frames", 3, "--json")
    assert (status, json.loads(out)["frames"]) == (0, 3)


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--frames", "0"),
        ("--frames", "-1"),
        ("--framerate", "0"),
        ("--timeout", "0"),
        ("--timeout", "nan"),
    ],
)
def test_impossible_number_is_refused_before_anything_runs(
    option, value, command, tmp_path
):
    program, ran = tmp_path / "program.py", tmp_path / "ran"
    program.write_text(f"open({str(ran)!r}, 'w')\n")
    status, out, err = command("run", program, option, value)
    assert (status, out) == (2, "")
    assert re.fullmatch(rf"mpmworlds run: {option} \S+: must be .*\n", err)
    assert not ran.exists()


@pytest.mark.parametrize(
    ("program", "status"),
    [
        ("def frames(:\n", "syntax_error"),
        ("import module_that_is_not_there\n", "import_error"),
        ("def frames():\n    yield 1 / 0\n", "exception"),
        ("print('nothing')\n", "no_frames"),
        ("def frames():\n    yield [[0]]\n", "bad_frames"),
        ("import time\ntime.sleep(60)\n", "timeout"),
    ],
    ids=lambda value: value.strip().partition("\n")[0],
)
def test_failed_program_is_a_typed_outcome(program, status, command, tmp_path):
    path, video = tmp_path / "program.py", tmp_path / "video.mp4"
    path.write_text(program)
    limit = 0.2 if status == "timeout" else 60
    arguments = ["run", path, "--out", video, "--timeout", limit]
    code, out, err = command(*arguments)
    assert (code, out.partition(":")[0]) == (1, status)
    assert err.strip(), "says nothing of what went wrong"
    code, out, err = command(*arguments, "--json")
    result = json.loads(out)
    assert (code, result["status"], err) == (1, status, "")
    assert result["message"]
    assert "frames_sha256" not in result
    assert not video.exists()


def test_colour_that_the_codec_changes_is_an_error_with_a_remedy(
    command, program_file, tmp_path
):
    text = program_file.read_text()
    program_file.write_text(re.sub(r"= \(\d+, \d+, \d+\)", "= (1, 2, 3)", text))
    status, _, err = command("run", program_file, "--out", tmp_path / "video.mp4")
    assert status == 2
    assert "colour #010203" in err
    assert "nearest is" in err
    assert not (tmp_path / "video.mp4").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["link", "absent.yaml"], "is not there; name a scene (.yaml)"),
        (
            ["run", "absent.yaml"],
            "is not there; name a scene (.yaml), or a program (.py)",
        ),
        (["run", "absent.py"], "is not there; name a program (.py)"),
        (
            ["play", "absent.yaml"],
            "is not there; name a scene (.yaml), or the id of a sam",
        ),
        (
            ["compare", "absent.yaml", "p0000"],
            "is not there; name a scene (.yaml), or the",
        ),
        (["link", "."], "is a folder; name a scene (.yaml)"),
    ],
)
def test_a_scene_that_is_not_there_is_told_in_plain_words(
    command, tmp_path, monkeypatch, arguments, told
):
    monkeypatch.chdir(tmp_path)
    status, out, err = command(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"mpmworlds {arguments[0]}: {arguments[1]}: {told}" in err
    assert "Errno" not in err


@pytest.mark.parametrize(
    "arguments",
    [
        ["verify", "a_file"],
        ["evaluate", "--predictor", "black", "--release", "a_file"],
        ["fetch", "p0000", "--release", "a_file"],
        ["regenerate", "p0000", "--release", "a_file"],
        ["gallery", "a_file", "--out", "site"],
        ["publish", "a_file", "--repo-id", "acme/mpmworlds"],
        ["train", "small", "--release", "a_file"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_file_is_no_folder_of_a_release(command, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").touch()
    status, out, err = command(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "a_file: is a file, must be the folder of a release; name that" in err


def test_interrupted_command_says_how_to_go_on(tmp_path):
    program, started = tmp_path / "program.py", tmp_path / "started"
    program.write_text(
        f"import time\nopen({str(started)!r}, 'w').close()\ntime.sleep(60)\n"
    )
    # A test run in the background ignores Ctrl-C, and so do the processes it starts.
    start = (
        "import signal, sys; from mpmworlds.cli import main; "
        "signal.signal(signal.SIGINT, signal.default_int_handler); "
        "sys.exit(main(['run', sys.argv[1], '--unsafe-no-sandbox']))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", start, program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        deadline = time.monotonic() + 60
        while not started.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        os.kill(running.pid, signal.SIGINT)
        out, err = running.communicate(timeout=60)
    assert (running.returncode, out) == (130, "")
    assert err == "mpmworlds run: interrupted; run it again to go on\n"
