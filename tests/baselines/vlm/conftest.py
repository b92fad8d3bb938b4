"""A tiny checkpoint, and tasks to ask it about."""

import pytest

from mpmworlds.baselines.scoring import task_of
from mpmworlds.loaders.load import load

pytest.importorskip("transformers", reason="needs mpmworlds[vlm]")


@pytest.fixture(scope="session")
def checkpoint(corpus, tmp_path_factory):
    """Folder of a tiny random model that knows the words of the corpus. Read-only."""
    from mpmworlds.loaders.scaffold import RULES, SKELETON
    from tests.baselines.vlm.tiny import make_checkpoint

    texts = [*corpus.programs.values(), RULES, SKELETON]
    return make_checkpoint(tmp_path_factory.mktemp("vlm") / "checkpoint", texts)


@pytest.fixture
def task(release):
    """What is asked of the first test sample: 6 frames of 64 pixels are seen."""
    return task_of(load(release, "test", "mini")[0])
