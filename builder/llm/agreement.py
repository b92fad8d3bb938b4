"""Whether a program implements its scene: colours and places at the start.

The program is read first, without running it; then its first frame is compared with
the layout of the scene. Reading it refuses what plainly reaches beyond a simulation,
such as other modules, files and names with two underscores. What is left runs in a
sandbox.
"""

import ast
from collections.abc import Callable, Iterator
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import Outcome, run
from mpmworlds.sim.scene.palette import BACKGROUND, rgb
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.similarity import layout_image

Mask = npt.NDArray[np.bool_]
TIMEOUT: Final = 120.0  # for the first frame, mostly compilation [s]
AREA_TOLERANCE: Final = 0.15  # relative; bodies are drawn as round-edged particles
LEAST_IOU: Final = 0.9  # of each colour, where a pixel along the edges is forgiven
MOST_DIFFERENCES: Final = 5  # that are told of one program
MODULES: Final = (
    *("cv2", "numpy", "taichi"),
    *("__future__", "collections", "colorsys", "dataclasses", "functools"),
    *("itertools", "math", "sys", "typing"),
)
REACHING: Final = frozenset(  # builtins that reach beyond a simulation
    {"__import__", "breakpoint", "compile", "delattr", "eval", "exec", "getattr"}
    | {"globals", "input", "locals", "memoryview", "open", "setattr", "vars"}
)
FILES: Final = frozenset(  # attributes of the modules that read, write or run
    {"DataSource", "FileStorage", "ctypeslib", "dump", "fromfile", "fromregex"}
    | {"genfromtxt", "imread", "imreadmulti", "imwrite", "imwritemulti", "load"}
    | {"loadtxt", "memmap", "modules", "open_memmap", "save", "savetxt", "savez"}
    | {"savez_compressed", "tofile", "aot", "tools", "VideoCapture", "f2py"}
    | {"distutils", "testing", "lib", "core", "_core", "settrace", "setprofile"}
)
MAIN: Final = "__name__"


def disagreements(
    scene: Scene,
    program: str,
    *,
    timeout: float = TIMEOUT,
    execute: Callable[..., Outcome] = run,
) -> list[str]:
    """What speaks against a program being that of a scene.

    Parameters
    ----------
    scene
        The scene.
    program
        Text that claims to implement it.
    timeout
        Wall time for the first frame [s].
    execute
        What runs it, as `mpmworlds.sim.run.run` does.

    Returns
    -------
    list of str
        A sentence each; empty if the program agrees. The program is run only if
        reading it finds nothing.
    """
    if program == link(scene):
        return []
    found = list(read_disagreements(program))[:MOST_DIFFERENCES]
    if found:
        return found
    outcome = execute(program, max_frames=1, timeout=timeout)
    if outcome.status != "ok":
        last = outcome.message.strip().rpartition("\n")[2]
        return [f"the program ends in {outcome.status} before its first frame: {last}"]
    return list(frame_disagreements(scene, outcome.frames[0]))


def read_disagreements(program: str) -> Iterator[str]:
    """What speaks against a program without running it.

    Parameters
    ----------
    program
        Text of the program.

    Yields
    ------
    str
        A sentence each.
    """
    try:
        tree = ast.parse(program)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        yield f"the program is not Python: {error}"
        return
    foreign = sorted(set(_imported(tree)) - set(MODULES))
    if foreign:
        yield f"the program imports {', '.join(foreign)}, beyond numpy, taichi and cv2"
    reaching = sorted(set(_reaching(tree)))
    if reaching:
        yield f"the program uses {', '.join(reaching)}, beyond what a simulation needs"
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    if "frames" not in names:
        yield "the program defines no function frames()"


def _imported(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            name = (node.module or "").partition(".")[0]
            yield "." * node.level + name


def _reaching(tree: ast.Module) -> Iterator[str]:
    """Names by which a program could get at more than its simulation."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            hidden = node.id.startswith("__") and node.id != MAIN
            if hidden or node.id in REACHING:
                yield node.id
        elif isinstance(node, ast.Attribute):
            if node.attr.startswith("__") or node.attr in FILES:
                yield node.attr
        elif isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names if alias.name in FILES)


def frame_disagreements(scene: Scene, frame: npt.NDArray[np.uint8]) -> Iterator[str]:
    """Differences between a first frame and the layout of a scene.

    Parameters
    ----------
    scene
        The scene.
    frame
        uint8 (H, W, 3), RGB.

    Yields
    ------
    str
        A sentence for each colour that is missing, foreign, or elsewhere.
    """
    pixels = scene.output.resolution
    if frame.shape != (pixels, pixels, 3):
        size = f"{frame.shape[0]} x {frame.shape[1]}"
        yield f"the first frame is {size} pixels, must be {pixels} x {pixels}"
        return
    layout = layout_image(scene, pixels)
    wanted, shown = _colors(layout), _colors(frame)
    jets = {
        thing.visualization.color
        for thing in scene.objects
        if thing.object_type == "emitter"
    }
    foreign = sorted(shown - wanted - jets)
    if foreign:
        yield (
            f"the first frame shows {len(foreign)} colours that no object has, such as "
            f"{foreign[0]}"
        )
    for color in sorted(wanted):
        if color not in shown:
            yield f"the first frame shows nothing in {color}"
        else:
            seen, there = ((i == rgb(color)).all(axis=2) for i in (frame, layout))
            yield from _mask_disagreements(color, seen, there)


def _colors(image: npt.NDArray[np.uint8]) -> set[str]:
    found = np.unique(image.reshape(-1, 3), axis=0)
    return {"#{:02X}{:02X}{:02X}".format(*color) for color in found} - {BACKGROUND}


def _mask_disagreements(color: str, seen: Mask, there: Mask) -> Iterator[str]:
    area, expected = int(seen.sum()), int(there.sum())
    edge = int((there & ~_eroded(there)).sum())
    if abs(area - expected) > AREA_TOLERANCE * expected + 0.5 * edge:
        yield (
            f"{color} covers {area} pixels of the first frame, must be near {expected}"
        )
    overlap = edge_iou(seen, there)
    if overlap < LEAST_IOU:
        yield (
            f"{color} is elsewhere in the first frame: its IoU with the layout is "
            f"{overlap:.2f}, must be >= {LEAST_IOU}"
        )


def edge_iou(one: Mask, other: Mask) -> float:
    """Intersection over union of two masks, with a pixel along the edges forgiven.

    Parameters
    ----------
    one, other
        Masks, bool (H, W), not both empty.

    Returns
    -------
    float
        In [0, 1]; a pixel of one mask counts as wrong if the other mask has none in its
        3 x 3 neighbourhood. [1]
    """
    union = int((one | other).sum())
    wrong = int((one & ~_dilated(other)).sum() + (other & ~_dilated(one)).sum())
    return 1.0 - wrong / union


def _dilated(mask: Mask) -> Mask:
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)


def _eroded(mask: Mask) -> Mask:
    return cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
