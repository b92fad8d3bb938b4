"""Scenes to edit: those of files, and seeds and parents of a corpus."""

from collections.abc import Sequence
from pathlib import Path

from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
from mpmworlds.files.text import read_text
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.ids import SampleId, SampleIdError


def read_parents(names: Sequence[str], manifest: Path | None) -> dict[str, Scene]:
    """Read scenes.

    Parameters
    ----------
    names
        Scene files, or ids of seeds and parents.
    manifest
        Corpus of such ids; the recorded one if None.

    Returns
    -------
    dict of Scene
        By id, or by the name of the file without its suffix.

    Raises
    ------
    ValueError
        If two files have one name, or a file is not UTF-8 text.
    LookupError
        If an id is not in the corpus.
    SceneError
        If a file is no valid scene.
    """
    roots = [name for name in names if _is_root(name)]
    scenes = _of_roots(roots, manifest) if roots else {}
    for path in (Path(name) for name in names if name not in roots):
        if path.stem in scenes:
            raise ValueError(
                f"--parent {path}: another parent is named {path.stem!r}; rename it"
            )
        scenes[path.stem] = Scene.from_yaml(read_text(path), str(path))
    return scenes


def _is_root(name: str) -> bool:
    """Whether a name is the id of a seed or parent."""
    try:
        return SampleId.parse(name).family == name
    except SampleIdError:
        return False


def _of_roots(names: list[str], manifest: Path | None) -> dict[str, Scene]:
    path = manifest or recorded_manifest("full")
    columns = read_table(path, ["id", "scene"]).to_pydict()
    texts = dict(zip(columns["id"], columns["scene"], strict=True))
    if missing := [name for name in names if name not in texts]:
        raise LookupError(f"--parent {missing[0]}: is not in {path}")
    return {name: Scene.from_yaml(texts[name], name) for name in names}
