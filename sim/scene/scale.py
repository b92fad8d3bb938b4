"""The same scene at another resolution or length."""

from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import FINE, steps_of, with_fewest_steps


def rescale(
    scene: Scene,
    grid_resolution: int,
    resolution: int,
    duration_frames: int | None = None,
) -> Scene:
    """Change cells and pixels per side, and what must change with them.

    The time step is the longest stable one and a frame lasts as long as before. The
    rate of emission counts particles, whose area has changed, so mass per time stays.

    Parameters
    ----------
    scene : Scene
        Where to start from.
    grid_resolution, resolution : int
        Cells and pixels per side.
    duration_frames : int, optional
        Frames of the video; as before if not given.

    Returns
    -------
    Scene
        A validated scene.
    """
    data = scene.to_data()
    sim = data["simulation"]
    ratio = grid_resolution / sim["grid_resolution"]
    sim |= steps_of(scene, FINE)
    sim["grid_resolution"] = grid_resolution
    sim["duration_frames"] = duration_frames or sim["duration_frames"]
    walls = data["environment"]["walls"]
    walls["thickness_cells"] = max(round(walls["thickness_cells"] * ratio), 3)
    data["output"]["resolution"] = resolution
    for thing in data["objects"]:
        if "emission" in thing:
            rate = thing["emission"]["rate"] * ratio**2
            thing["emission"]["rate"] = float(f"{rate:.9g}")
    scaled = Scene.from_data(data, f"scene at {grid_resolution} cells")
    return with_fewest_steps(scaled)
