"""The state of a program is read if it has the names of ours, and told why if not."""

import numpy as np
import pytest

from mpmworlds.sim.run.run import run

FOREIGN = """\
import numpy as np

class Field:
    def __init__(self, values):
        self.values = np.asarray(values)
    def to_numpy(self):
        return self.values
    def __getitem__(self, index):
        return self.values

AREA, SIMULATION, ENVIRONMENT = 0.5, {"time_step_dt": 0.1}, {"gravity": [0.0, -2.0]}
MATTER = [{}, {"density": 4.0}]
owner, alive, clock = Field([1, 1, 1]), Field(2), Field(5)
x, v = Field([[1.0, 2.0]] * 3), Field([[3.0, 4.0]] * 3)

def frames():
    yield np.zeros((4, 6, 3), np.uint8)
    clock.values = clock.values + 5
    alive.values = alive.values + 1
    yield np.zeros((4, 6, 3), np.uint8)
"""


def test_any_program_with_the_names_of_ours_has_states():
    outcome = run(FOREIGN, states=True)
    states = outcome.states
    assert (outcome.status, outcome.message) == ("ok", "")
    np.testing.assert_allclose(states.time, [0.5, 1.0])
    assert states.object_id.tolist() == [1, 1, 1]
    assert states.mass.tolist() == [2.0, 2.0, 2.0]
    assert states.born.sum(axis=1).tolist() == [2, 3]
    assert states.positions[1].tolist() == [[1.0, 2.0]] * 3
    assert states.velocities[1].tolist() == [[3.0, 4.0]] * 3
    assert states.poses.shape == states.rates.shape == (2, 0, 3)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("x, v =", "x, w ="), "the program has no v at its top"),
        (
            ("owner, alive, clock =", "owners, living, steps ="),
            "the program has no alive, clock, owner at its top",
        ),
        (
            ("[[1.0, 2.0]] * 3", "[[1.0, 2.0, 0.0]] * 3"),
            "living x and v are (2, 3) and (2, 2), must be (2, 2)",
        ),
        (("Field([1, 1, 1])", "[1, 1, 1]"), "cannot be read: AttributeError"),
        (("Field([1, 1, 1])", "Field([1, 1, 9])"), "cannot be read: IndexError"),
        (('"gravity"', '"weight"'), "cannot be read: KeyError: 'gravity'"),
        (("[0.0, -2.0]", "[0.0, -2.0, 0.0]"), "cannot be read: ValueError"),
        (("Field([1, 1, 1])", "Field([1])"), "the state of frame 0 has another size"),
        (
            ("\ndef frames", "\nCOLLIDERS, pose, twist = [0], x, v\ndef frames"),
            "the state of frame 0 has another size",
        ),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else None,
)
def test_program_whose_state_cannot_be_read_says_what_is_missing(change, told):
    text = FOREIGN.replace(*change)
    assert text != FOREIGN
    outcome = run(text, states=True)
    assert (outcome.status, outcome.states) == ("no_states", None)
    assert told in outcome.message


def test_program_without_state_is_fine_if_none_is_asked_for():
    outcome = run(FOREIGN.replace("x, v =", "x, w ="))
    assert (outcome.status, outcome.states) == ("ok", None)


@pytest.mark.parametrize(
    ("end", "status"),
    [
        ("    1 / 0\n", "exception"),
        ("    yield 3\n", "bad_frames"),
        ("    yield np.zeros((4, 5, 3), np.uint8)\n", "bad_frames"),
        ("    import os; os.abort()\n", "crash"),
        ("    while True: pass\n", "timeout"),
    ],
)
def test_program_that_fails_leaves_the_states_of_its_frames(end, status):
    outcome = run(FOREIGN + end, timeout=3, states=True)
    assert (outcome.status, len(outcome.frames)) == (status, 2)
    assert outcome.states.time.tolist() == [0.5, 1.0]


def test_states_are_as_many_as_the_frames_asked_for():
    assert len(run(FOREIGN, max_frames=1, states=True).states.time) == 1
