"""Training of a LoRA for continuation: `mpmworlds train vdm`.

What is trained on is made on the fly, not stored beforehand: a clip has as many windows
as places to start, the text is a small part of a step, and a store of either would be
hundreds of gigabytes that fall behind when a text, a size or a model changes.
"""

from pathlib import Path

from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.baselines.vdm.predictor import needs
from mpmworlds.baselines.vdm.settings import TrainingSettings
from mpmworlds.loaders.export.folder import Source


def train(source: Source, settings: Settings, out_dir: Path, *, progress: bool) -> Path:
    """Train a LoRA, or go on with it; see `learned.families.Training`.

    Raises
    ------
    MissingExtraError, TooLittleMemoryError, RuntimeError
        If a package, memory or the device is missing.
    CheckpointError
        If the folder holds another training.
    """
    assert isinstance(settings, TrainingSettings)
    needs()
    from mpmworlds.baselines.vdm.lora.loop import train_lora

    return train_lora(source, settings, out_dir, progress=progress)
