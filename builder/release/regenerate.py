"""One sample from its scene to its video, and whether that is the one released."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2

from mpmworlds.builder.parameters import Parameters
from mpmworlds.builder.plan.lookup import recorded_namesakes
from mpmworlds.builder.plan.manifest import (
    read_table,
    recorded_manifest,
    text_sha256,
)
from mpmworlds.builder.release.layout import MAIN
from mpmworlds.builder.release.rows import any_row, namesakes
from mpmworlds.builder.release.tiers import Tier, tier_of
from mpmworlds.files.atomic import write_atomically
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import Frames, encode_mp4
from mpmworlds.sim.run.run import run
from mpmworlds.sim.run.sheet import contact_sheet
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.ids import SampleId


@dataclass(frozen=True)
class Regenerated:
    """A sample that was made anew."""

    id: str
    source: str
    """Where its scene is from: a configuration of a release, or a recorded corpus."""
    namesakes: Sequence[str]
    """Configurations of other corpora that have another sample of this id."""
    row: Mapping[str, Any]
    """What is said of it there."""
    scene: str
    """YAML."""
    program: str
    frames: Frames
    """uint8 (T, N, N, 3), RGB."""
    framerate: int
    """Frames per second. [1/s]"""

    def write(self, folder: Path) -> list[Path]:
        """Write scene, program, video and contact sheet into a folder."""
        sheet = cv2.cvtColor(contact_sheet(self.frames), cv2.COLOR_RGB2BGR)
        contents = {
            "scene.yaml": self.scene.encode(),
            "program.py": self.program.encode(),
            "video.mp4": encode_mp4(self.frames, self.framerate),
            "sheet.png": bytes(cv2.imencode(".png", sheet)[1]),
        }
        for name, data in contents.items():
            write_atomically(folder / name, data)
        return [folder / name for name in contents]

    def compared(self) -> Tier:
        """Say how equal it is to what the row has.

        Raises
        ------
        ValueError
            If the row has no video to compare with, or one that cannot be decoded.
        """
        _check_comparable(self.row, self.id, self.source)
        if (
            self.row["program"] != self.program
            or text_sha256(self.program) != self.row["program_sha256"]
        ):
            return Tier(
                "neither",
                "neither equal nor comparable: its scene links to another program "
                "here; install the version of mpmworlds that made the release",
            )
        return tier_of(self.frames, self.row)


def regenerate(
    sample: str,
    release: Path | None = None,
    config: str | None = None,
    params: Parameters | None = None,
    *,
    to_compare: bool = False,
) -> Regenerated:
    """Link the scene of a sample and run the program.

    Parameters
    ----------
    sample
        Its id.
    release
        Folder of a release that has it; else it is one of the package's own.
    config
        A configuration of the release, by default the first that has it, see
        `Record.in_order`; or whose recorded rows are meant, by default those of `MAIN`.
    params
        What the configurations are; those of the package by default.
    to_compare
        Refuse a row that has no video to compare with, before anything is simulated.

    Returns
    -------
    Regenerated
        Scene, program and frames.

    Raises
    ------
    LookupError, ValueError
        If there is no such sample, or its scene is not valid, or nothing to compare.
    RunError
        If its program fails.
    """
    SampleId.parse(sample)  # it may become the name of a folder
    if release is not None:
        name, row = any_row(release, sample, config)
        source = f"{release}: {name}"
        others = namesakes(release, sample, name)
    else:
        name, row = _recorded(sample, config or MAIN, params or Parameters.read())
        source = f"the recorded corpus {name}"
        others = recorded_namesakes(sample, name)
    if to_compare:
        _check_comparable(row, sample, source)
    text = row["scene"]
    if not isinstance(text, str):
        raise ValueError(f"{sample}: {source} has no scene of it; verify the release")
    scene = Scene.from_yaml(text, sample)
    program = link(scene)
    frames = run(program, trusted=True).expect()
    rate = scene.output.framerate
    return Regenerated(sample, source, others, row, text, program, frames, rate)


def _check_comparable(row: Mapping[str, Any], sample: str, source: str) -> None:
    if "clip" not in row or row["frames_sha256"] is None:
        raise ValueError(
            f"{sample}: {source} has no video of it to compare with; name a release "
            "and a configuration with videos: --release DIR --config NAME"
        )


def _recorded(
    sample: str, config: str, params: Parameters
) -> tuple[str, dict[str, Any]]:
    """Name of a recorded corpus, and a row of it."""
    profile, _ = params.subset(config)
    path = recorded_manifest(profile)
    ids = read_table(path, ["id"])["id"].to_pylist()
    if sample not in ids:
        raise LookupError(
            f"{sample}: is not in the corpus {profile!r}; choose another --config, or "
            f"find one by `mpmworlds materialise --config {profile} --list-ids`"
        )
    row: dict[str, Any] = read_table(path).slice(ids.index(sample), 1).to_pylist()[0]
    return profile, row
