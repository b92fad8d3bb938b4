"""A program whose matter starts a hair away from where it does, to see its chaos."""

from typing import Final

DISTANCE: Final = 1e-6  # by which particles and rigid bodies are displaced at most [m]
_MORE: Final = '''

frames_in_place = frames


def frames():
    """Yield the frames of a world whose matter starts a hair away."""
    rng = np.random.default_rng({seed})
    for n, image in enumerate(frames_in_place()):
        if n == 0:
            for name in ("x", "pose"):
                if name in globals():
                    field = globals()[name]
                    rows = field.to_numpy()
                    count = len(rows) if name == "x" else globals().get("BODIES", 0)
                    shift = {distance} * rng.uniform(-1.0, 1.0, (count, 2))
                    rows[:count, :2] += shift.astype(np.float32)
                    field.from_numpy(rows)
        yield image
'''


def displaced(program: str, seed: int) -> str:
    """The text of a program whose matter starts at other places, by up to `DISTANCE`.

    Parameters
    ----------
    program
        Text that the linker wrote.
    seed
        Which displacements; of every particle, also of those that are born later, and
        of the centers of rigid bodies.

    Returns
    -------
    str
        Text whose first frame is the same.
    """
    return program + _MORE.format(seed=seed, distance=DISTANCE)
