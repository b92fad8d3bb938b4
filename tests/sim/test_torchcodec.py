"""What torchcodec decodes is held to the frames; that it is absent is told plainly."""

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from mpmworlds.sim.run import torchcodec
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4
from mpmworlds.sim.run.torchcodec import judge_torchcodec
from mpmworlds.sim.scene.palette import PALETTE, rgb


@pytest.fixture(scope="module")
def video():
    colors = np.array([rgb(color) for color in PALETTE.values()], np.uint8)
    drawn = np.random.default_rng(0).integers(0, len(colors), (12, 64, 64))
    return encode_mp4(colors[drawn], 30)


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Function that makes a module of the name, for this process and its children."""

    def make(text):
        package = tmp_path / "torchcodec"
        package.mkdir()
        (package / "__init__.py").write_text("")
        (package / "decoders.py").write_text(text)
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))
        monkeypatch.setattr(torchcodec, "find_spec", lambda _: package)

    return make


def test_that_it_is_not_there_is_told(video, monkeypatch):
    monkeypatch.setattr(torchcodec, "find_spec", lambda _: None)
    assert judge_torchcodec(video) == (False, "not there")


def test_why_it_cannot_be_loaded_is_told_in_a_line(video, stand_in):
    stand_in("raise RuntimeError('Could not load libtorchcodec' + 200 * '.')")
    good, told = judge_torchcodec(video)
    assert not good
    assert told.startswith("cannot be loaded: RuntimeError: Could not load libtorch")
    assert len(told) < 150


def test_wrong_colours_are_told(video, stand_in):
    stand_in("""
import numpy as np
class Frames(np.ndarray):
    def contiguous(self): return self
    def numpy(self): return np.asarray(self)
def VideoDecoder(data, dimension_order):
    return np.zeros((12, 64, 64, 3), np.uint8).view(Frames)
""")
    assert judge_torchcodec(video) == (False, "gives WRONG COLOURS")


@pytest.mark.skipif(
    find_spec("torchcodec") is None, reason="torchcodec is not installed: [video]"
)
def test_datasets_decodes_the_same_frames(video):
    good, told = judge_torchcodec(video)
    if not good and told.startswith("cannot be loaded"):
        pytest.skip(f"torchcodec {told} on {sys.platform}")
    assert (good, told) == (True, "exact")
    import datasets

    table = datasets.Dataset.from_dict({"video": [{"bytes": video, "path": None}]})
    (row,) = table.cast_column("video", datasets.Video())
    frames = np.stack([frame.numpy() for frame in row["video"][:]])
    np.testing.assert_array_equal(frames.transpose(0, 2, 3, 1), decode_mp4(video))
