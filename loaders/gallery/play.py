"""A scene -> a page on which it plays: a gallery of one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpmworlds.loaders.clips import CLIP, VIDEO
from mpmworlds.loaders.gallery.files import key_of, names_of, write_files
from mpmworlds.loaders.gallery.index import index_of
from mpmworlds.loaders.gallery.site import PAGE, Site
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import encode_mp4, frames_sha256
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene


def row_of_scene(scene: Scene, name: str) -> dict[str, Any]:
    """What a release would tell of a scene that is of no corpus."""
    materials = sorted(scene.materials)
    return {
        "id": name,
        "kind": "scene",
        "parent_id": "",
        "split": "",
        "seeds": [],
        "edit": "",
        "scene": scene.to_yaml(),
        "materials": materials,
        "object_types": sorted({thing.object_type for thing in scene.objects}),
        "num_objects": len(scene.objects),
        "motion": None,
    }


def write_play(row: Mapping[str, Any], out: Path, parent: str | None = None) -> Path:
    """Write a page that plays one sample, running its program if there is no video.

    Parameters
    ----------
    row
        Columns of a recipe: of a release, of a manifest, or of `row_of_scene`.
    out
        Folder of the page: new, empty, or a gallery.
    parent
        Scene that it was made from, if that is known.

    Returns
    -------
    Path
        What to open.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    RuntimeError
        If the program fails.
    ValueError
        If the scene is none, or the folder holds something else.
    """
    sample = str(row["id"])
    names = names_of(sample, exact=True)
    with Site(out) as site:
        whole = row if row.get(VIDEO) or row.get(CLIP) else rendered(row)
        exact = bool(whole.get(VIDEO))
        names = names_of(sample, exact=exact)
        key = key_of(whole, parent, exact=exact)
        if not site.is_complete(sample, key, names):
            site.begin([sample])
            write_files(out, whole, parent, exact=exact)
            site.complete(sample, key)
        site.finish(index_of([whole], sample, exact=exact), {sample: names})
    return out / PAGE


def rendered(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of a recipe with its program, run, and its exact video.

    Raises
    ------
    RuntimeError
        If the program fails.
    ValueError
        If the scene is none.
    """
    scene = Scene.from_yaml(row["scene"], row["id"])
    program = link(scene)
    frames = run(program, trusted=True).expect()
    video = encode_mp4(frames, scene.output.framerate)
    return {
        **row,
        "program": program,
        VIDEO: {"bytes": video, "path": f"{row['id']}.mp4"},
        "frames_sha256": frames_sha256(frames),
        "num_frames": len(frames),
        "framerate": scene.output.framerate,
        "resolution": scene.output.resolution,
    }
