"""A new feature is one file in the folder of its kind, and nothing else."""

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NEW = {
    "materials": "neo_hookean.py",
    "motions": "pendulum.py",
    "shapes": "crescent.py",
}
SCENE = """\
schema: mpmworlds-scene/1
simulation: {grid_resolution: 32, time_step_dt: 4.0e-4, substeps_per_frame: 25,
  duration_frames: 4, particles_per_cell: 4, seed: 1}
environment:
  gravity: [0.0, -9.8]
  walls: {contact: separate, friction: 0.2, thickness_cells: 3}
objects:
- name: object_0
  object_type: dynamic_body
  shape: {type: crescent, center: [0.3, 0.6], radius: 0.14, offset: 0.1}
  physics_properties: {constitutive_model: neo_hookean, density: 1000.0,
    youngs_modulus: 1.0e5, poissons_ratio: 0.3}
  visualization: {color: '#F52D2C'}
- name: object_1
  object_type: static_collider
  shape: {type: crescent, center: [0.3, 0.25], radius: 0.14, offset: 0.1,
    angle_deg: 90.0}
  visualization: {color: '#969696'}
- name: object_2
  object_type: kinematic_collider
  shape: {type: crescent, center: [0.7, 0.4], radius: 0.1, offset: 0.06}
  kinematics: {type: pendulum, length: 0.3, swing_deg: 20.0}
  visualization: {color: '#F5F42C'}
output: {resolution: 64, framerate: 30}
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory):
    """A copy of the package with three more files."""
    folder = tmp_path_factory.mktemp("extended")
    ignored = shutil.ignore_patterns("recorded", "__pycache__")
    shutil.copytree(
        ROOT / "src/mpmworlds", folder / "mpmworlds", symlinks=False, ignore=ignored
    )
    for kind, name in NEW.items():
        source = Path(__file__).parent / "extensions" / name
        shutil.copy(source, folder / "mpmworlds/sim/program/features" / kind / name)
    return folder


def python(folder, code, *arguments):
    """Output of Python with the extended package."""
    found = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), *arguments],
        env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_the_package_as_it_is_knows_none():
    from mpmworlds.sim.scene.scene import Scene, SceneError

    with pytest.raises(SceneError, match="crescent"):
        Scene.from_yaml(SCENE)


def test_a_scene_of_new_features_is_read_linked_and_run(extended, tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    program = tmp_path / "program.py"
    code = """
        import sys
        from pathlib import Path

        from mpmworlds.sim.program.link import link
        from mpmworlds.sim.run.run import run
        from mpmworlds.sim.scene.scene import Scene

        scene, program = map(Path, sys.argv[1:])
        program.write_text(link(Scene.from_yaml(scene.read_text("utf-8"))))
        outcome = run(program.read_text(), states=True)
        frames, states = outcome.expect(), outcome.states
        colors = {tuple(color) for color in frames[-1].reshape(-1, 3).tolist()}
        print(len(frames), len(colors), *states.poses[0, 0].round(6))
    """
    told = python(extended, code, str(tmp_path / "scene.yaml"), str(program))
    frames, colors, x, y, *_ = told.split()
    assert (int(frames), int(colors)) == (4, 4)
    assert (float(x), float(y)) == pytest.approx((0.802606, 0.418092), abs=1e-5)
    text = program.read_text("utf-8")
    for part in ("def crescent(x, y, radius, offset)", "neo_hookean(F[p], 1e5, 0.3)"):
        assert part in text
    subprocess.run(
        [sys.executable, "-m", "ruff", "format", "--check", str(program)], check=True
    )


def test_a_new_law_is_tested_by_all_that_laws_are_tested_by(extended):
    laws = "tests/sim/test_laws.py"
    tests = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", laws, "-k"]
    environment = os.environ | {"PYTHONPATH": str(extended)}

    def told(which):
        return subprocess.run(
            [*tests, which],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )

    assert told("neo_hookean").returncode == 0
    unknown = told("energy_of_every_law")
    assert unknown.returncode == 1
    assert "'neo_hookean'" in unknown.stdout
