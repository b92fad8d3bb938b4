"""The same scene at another resolution or length."""

from mpmworlds.sim.scene.scene import Scene


def rescale(
    scene: Scene,
    grid_resolution: int,
    resolution: int,
    duration_frames: int | None = None,
) -> Scene:
    """Change cells and pixels per side, and what must change with them.

    The time step follows the cell size and a frame lasts as long as before. The rate of
    emission counts particles, whose area has changed, so mass per time stays.

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
    frame_time = sim["time_step_dt"] * sim["substeps_per_frame"]
    ratio = grid_resolution / sim["grid_resolution"]
    sim["substeps_per_frame"] = max(round(sim["substeps_per_frame"] * ratio), 1)
    sim["time_step_dt"] = float(f"{frame_time / sim['substeps_per_frame']:.9g}")
    sim["grid_resolution"] = grid_resolution
    sim["duration_frames"] = duration_frames or sim["duration_frames"]
    walls = data["environment"]["walls"]
    walls["thickness_cells"] = max(round(walls["thickness_cells"] * ratio), 3)
    data["output"]["resolution"] = resolution
    for thing in data["objects"]:
        if "emission" in thing:
            rate = thing["emission"]["rate"] * ratio**2
            thing["emission"]["rate"] = float(f"{rate:.9g}")
    return Scene.from_data(data, f"scene at {grid_resolution} cells")
