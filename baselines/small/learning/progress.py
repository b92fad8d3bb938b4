"""How far a training has come: what it is made of, its log, its last checkpoint."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from accelerate import Accelerator

from mpmworlds.baselines.learned.losses import forget_after
from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.journal import append_records

MADE_OF: Final = "training.json"
LOG: Final = "log.jsonl"
STATES: Final = "states"


class Progress:
    """The folder of a training.

    Parameters
    ----------
    folder
        Is made if it is not there.
    settings, made_of
        Of the training; a folder of another one is refused.
    main
        Whether this process is the one that writes.

    Raises
    ------
    ValueError
        If the folder holds another training.
    """

    def __init__(
        self,
        folder: Path,
        settings: Settings,
        made_of: Mapping[str, Any],
        *,
        main: bool,
    ) -> None:
        self._folder, self._main = folder, main
        path = folder / MADE_OF
        made = {"settings": settings.model_dump(mode="json"), "made_of": dict(made_of)}
        if path.is_file():
            known = json.loads(path.read_text("utf-8"))
            differs = [
                f"{key} = {known[part].get(key)!r}, now {made[part].get(key)!r}"
                for part in made
                for key in sorted({*made[part], *known[part]})
                if known[part].get(key) != made[part].get(key)
            ]
            if differs:
                raise ValueError(
                    f"{folder}: holds another training ({'; '.join(differs)}); name "
                    "another folder, or remove that one"
                )
        elif main:
            folder.mkdir(parents=True, exist_ok=True)
            text = json.dumps(made, indent=2, sort_keys=True) + "\n"
            write_atomically(path, text.encode())

    def resumed(self, accelerator: Accelerator, *others: Any) -> int:
        """Load the last checkpoint, if there is one.

        Parameters
        ----------
        accelerator
            Has prepared what has a state.
        others
            What else has one.

        Returns
        -------
        int
            Number of steps that are done.
        """
        accelerator.register_for_checkpointing(*others)
        steps = sorted(
            int(path.name)
            for path in (self._folder / STATES).glob("*")
            if path.name.isdecimal()
        )
        done = steps[-1] if steps else 0
        if done:
            accelerator.load_state(str(self._folder / STATES / str(done)))
        if self._main:  # what was logged after the checkpoint comes again
            forget_after(self._folder / LOG, done)
        return done

    def save(self, accelerator: Accelerator, step: int) -> None:
        """Write a checkpoint, and forget the one before."""
        states = self._folder / STATES
        part, whole = states / f".{step}.part", states / str(step)
        accelerator.save_state(str(part))
        accelerator.wait_for_everyone()
        if not self._main:
            return
        if whole.exists():
            shutil.rmtree(whole)
        part.rename(whole)
        for other in states.iterdir():
            if other != whole:
                shutil.rmtree(other)

    def note(self, step: int, told: Mapping[str, float]) -> None:
        """Add a line to the log."""
        if self._main:
            rounded = {key: float(f"{value:.6g}") for key, value in told.items()}
            append_records(self._folder / LOG, [{"step": step, **rounded}])
