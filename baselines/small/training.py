"""Training of the label model: `mpmworlds train small`."""

from pathlib import Path

from mpmworlds.baselines.learned.extras import need
from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.baselines.small.settings import TrainingSettings
from mpmworlds.loaders.export.folder import Source


def train(source: Source, settings: Settings, out_dir: Path, *, progress: bool) -> Path:
    """Train a label model, or go on with it; see `learned.families.Training`.

    Raises
    ------
    MissingExtraError
        If a package is missing.
    ValueError
        If the folder holds another training, the release has no such samples, or their
        videos are too short.
    """
    assert isinstance(settings, TrainingSettings)
    need("small", "accelerate", "safetensors", "torch")
    from mpmworlds.baselines.small.learning.loop import train_network

    return train_network(source, settings, out_dir, progress=progress)
