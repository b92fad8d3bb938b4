"""The state of a program at every frame, as it comes from the program itself."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Track:
    """Where particles and solids are at each of T frames, and how they move.

    N particles and K solids, in the order of the program. A particle that is lost to
    overflow is NaN from then on.

    Attributes
    ----------
    time : ndarray of float64, shape (T,)
        Simulated time [s].
    owner : ndarray of int16, shape (N,)
        Number of the object that a particle belongs to, 0 if the program does not say.
    mass : ndarray of float32, shape (N,)
        Mass of particles [kg], NaN if the program does not say.
    positions, velocities : ndarray of float32, shape (T, N, 2)
        Of particles [m, m/s], NaN before their birth.
    poses : ndarray of float64, shape (T, K, 3)
        Centers of solids [m] and their angles [rad], which go on past a full turn.
    rates : ndarray of float64, shape (T, K, 3)
        Velocities of the centers [m/s] and spins [rad/s].
    """

    time: Floats
    owner: npt.NDArray[np.int16]
    mass: Singles
    positions: Singles
    velocities: Singles
    poses: Floats
    rates: Floats


class Recording:
    """Gathers the messages of `child` about states, in the order in which they come."""

    def __init__(self) -> None:
        self._frame = np.nan
        self._states: list[tuple[int, int, Singles]] = []

    def begin(self, payload: bytes | bytearray) -> None:
        """Take in the simulated time between frames."""
        self._frame = float(np.frombuffer(payload, "<f8")[0])

    def add(self, particles: int, solids: int, payload: bytes | bytearray) -> bool:
        """Take in the state of the next frame; False if it is of another size."""
        numbers = np.frombuffer(payload, "<f4").astype(np.float32)
        counts = self._states[0][:2] if self._states else (particles, solids)
        fits = numbers.size == 6 * particles + 7 * solids
        if fits and counts == (particles, solids):
            self._states.append((particles, solids, numbers))
            return True
        return False

    def track(self, frames: int) -> Track | None:
        """What has come for so many frames; None if nothing has."""
        if not self._states[:frames]:
            return None
        N, K, _ = self._states[0]
        numbers = np.stack([state for _, _, state in self._states[:frames]])
        ends = np.cumsum([2 * N, 2 * N, N, N, 4 * K])
        x, v, owner, mass, pose, twist = np.split(numbers, ends, axis=1)
        T = len(numbers)
        x, v = (part.reshape(T, N, 2).copy() for part in (x, v))
        x[owner < 0], v[owner < 0] = np.nan, np.nan
        poses, rates = (
            part.reshape(T, K, n).astype(np.float64)
            for part, n in ((pose, 4), (twist, 3))
        )
        time = self._frame * np.arange(T, dtype=np.float64)
        angle = unwrap(np.arctan2(poses[..., 3], poses[..., 2]), rates[..., 2], time)
        last = owner[-1]
        return Track(
            time=time,
            owner=np.where(last < 0, -1 - last, last).astype(np.int16),
            mass=mass[-1].copy(),
            positions=x,
            velocities=v,
            poses=np.concatenate([poses[..., :2], angle[..., None]], axis=-1),
            rates=rates,
        )


def unwrap(angle: Floats, spin: Floats, time: Floats) -> Floats:
    """Angles that go on past a full turn, also where a frame is more than half a turn.

    Parameters
    ----------
    angle : ndarray, shape (T, K)
        Angles [rad] but for full turns.
    spin : ndarray, shape (T, K)
        Their rates [rad/s]. The mean over two frames tells how many turns are between.
    time : ndarray, shape (T,)
        Times [s].

    Returns
    -------
    ndarray, shape (T, K)
        Angles [rad]; the first ones are as given.
    """
    steps = np.diff(angle, axis=0)
    turned = 0.5 * (spin[1:] + spin[:-1]) * np.diff(time)[:, None]
    steps += 2 * np.pi * np.round((turned - steps) / (2 * np.pi))
    return np.concatenate([angle[:1], angle[:1] + np.cumsum(steps, axis=0)])
