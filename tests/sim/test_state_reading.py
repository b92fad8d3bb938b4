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

DT, SUBSTEPS = 0.1, 5
owner, birth, mass = Field([1, 1, 1]), Field([-1, 0, 5]), Field([2.0, 2.0, 3.0])
x, v = Field([[1.0, 2.0]] * 3), Field([[3.0, 4.0]] * 3)

def frames():
    for n in range(3):
        yield np.zeros((4, 6, 3), np.uint8)
"""


def test_any_program_with_the_names_of_ours_has_states():
    outcome = run(FOREIGN, states=True)
    states = outcome.states
    assert (outcome.status, outcome.message) == ("ok", "")
    np.testing.assert_allclose(states.time, [0.0, 0.5, 1.0])
    assert states.owner.tolist() == [1, 1, 1]
    assert states.mass.tolist() == [2.0, 2.0, 3.0]
    born = ~np.isnan(states.positions[..., 0])
    assert born.tolist() == [[True, False, False], [True, True, False], [True] * 3]
    assert states.positions[2].tolist() == [[1.0, 2.0]] * 3
    assert states.velocities[2].tolist() == [[3.0, 4.0]] * 3
    assert states.poses.shape == states.rates.shape == (3, 0, 3)


def test_program_need_not_tell_whose_particles_are_nor_what_they_weigh():
    text = FOREIGN.replace("owner, birth, mass =", "o, b, m =")
    states = run(text, states=True).states
    assert states.owner.tolist() == [0, 0, 0]
    assert np.isnan(states.mass).all()
    assert not np.isnan(states.positions).any()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("DT, SUBSTEPS =", "dt, steps ="), "the program has no DT, SUBSTEPS at its"),
        (("SUBSTEPS = 0.1, 5", "OTHER = 0.1, 5"), "the program has no SUBSTEPS at its"),
        (("[[3.0, 4.0]] * 3", "[[3.0, 4.0]] * 2"), "x and v have lengths 3 and 2"),
        (("[[1.0, 2.0]] * 3", "[[1.0, 2.0, 0.0]] * 3"), "x has shape (3, 3), must be"),
        (("Field([1, 1, 1])", "[1, 1, 1]"), "cannot be read: AttributeError"),
        (("Field([1, 1, 1])", "Field([1])"), "owner has length 1, must be 3 as x"),
        (("Field([-1, 0, 5])", "Field([1])"), "birth has length 1, must be 3 as x"),
        (("DT, SUBSTEPS = 0.1", "DT, SUBSTEPS = '0.1'"), "cannot be read"),
        (("\ndef frames", "\npose = x\ndef frames"), "pose has shape (3, 2), must be"),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else None,
)
def test_program_whose_state_cannot_be_read_says_what_is_missing(change, told):
    text = FOREIGN.replace(*change)
    assert text != FOREIGN
    outcome = run(text, states=True)
    assert (outcome.status, outcome.states) == ("no_states", None)
    assert told in outcome.message


def test_program_whose_particles_change_in_number_has_no_states():
    text = FOREIGN + "        x.values = v.values = np.zeros((n + 4, 2))\n"
    text = text.replace("owner, birth, mass =", "o, b, m =")
    outcome = run(text, states=True)
    assert outcome.status == "no_states"
    assert "the state of frame 1 has another size" in outcome.message


def test_program_without_state_is_fine_if_none_is_asked_for():
    outcome = run(FOREIGN.replace("DT, SUBSTEPS =", "dt, steps ="))
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
    assert (outcome.status, len(outcome.frames)) == (status, 3)
    np.testing.assert_allclose(outcome.states.time, [0.0, 0.5, 1.0])


def test_states_are_as_many_as_the_frames_asked_for():
    assert len(run(FOREIGN, max_frames=1, states=True).states.time) == 1
