"""The state of matter and solids at every frame, and its invariants.

A solid is an object that does not consist of particles: a collider, whose motion is
prescribed, or a rigid body. Two dimensions: masses and the like are per unit thickness.
"""

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from mpmworlds.files.atomic import write_atomically

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Dtype = Literal["float16", "float32"]


@dataclass(frozen=True, eq=False)
class States:
    """Where everything is at each of T frames, and how it moves.

    N particles, in order of birth, and K solids. A particle that is lost to overflow is
    NaN from then on, and so are the invariants.

    Attributes
    ----------
    time : ndarray of float64, shape (T,)
        Simulated time [s].
    object_id : ndarray of int16, shape (N,)
        Index in the scene of the object that a particle belongs to.
    mass : ndarray of float32, shape (N,)
        Mass of particles [kg].
    positions, velocities : ndarray of float32, shape (T, N, 2)
        Of particles [m, m/s], NaN before their birth.
    poses : ndarray of float64, shape (T, K, 3)
        Centers of solids [m] and their angles [rad], which go on past a full turn.
    rates : ndarray of float64, shape (T, K, 3)
        Velocities of the centers [m/s] and spins [rad/s], 0 for colliders at time 0.
    solid_id : ndarray of int16, shape (K,)
        Index in the scene of a solid.
    solid_mass, solid_inertia : ndarray of float64, shape (K,)
        Mass [kg] and moment of inertia about the center [kg m^2] of rigid bodies,
        infinite for colliders.
    gravity : ndarray of float64, shape (2,)
        Acceleration [m/s^2].
    """

    time: Floats
    object_id: npt.NDArray[np.int16]
    mass: Singles
    positions: Singles
    velocities: Singles
    poses: Floats
    rates: Floats
    solid_id: npt.NDArray[np.int16]
    solid_mass: Floats
    solid_inertia: Floats
    gravity: Floats

    @property
    def born(self) -> npt.NDArray[np.bool_]:
        """Which particles have been born, (T, N)."""
        known = ~np.isnan(self.positions[..., 0])
        return np.logical_or.accumulate(known, axis=0)


class Recording:
    """Gathers the messages of `child` about states, in the order in which they come."""

    def __init__(self) -> None:
        self._numbers = np.zeros(0)
        self._particles, self._solids = 0, 0
        self._states: list[tuple[int, int, Singles]] = []

    def cast(self, particles: int, solids: int, payload: bytes | bytearray) -> None:
        """Take in what never changes."""
        self._particles, self._solids = particles, solids
        self._numbers = np.frombuffer(payload, "<f8").astype(np.float64)

    def add(self, living: int, steps: int, payload: bytes | bytearray) -> bool:
        """Take in the state of the next frame; False if it is of another size."""
        numbers = np.frombuffer(payload, "<f4").astype(np.float32)
        fits = numbers.size == 4 * living + 8 * self._solids
        if fits and living <= self._particles:
            self._states.append((living, steps, numbers))
            return True
        return False

    def states(self, frames: int) -> States | None:
        """What has come for so many frames; None if nothing has."""
        states, N, K = self._states[:frames], self._particles, self._solids
        if not states:
            return None
        ends = np.cumsum([N, N, K, K, K, 2])
        owner, mass, solids, solid_mass, inertia, gravity, rest = np.split(
            self._numbers, ends
        )
        time = rest[0] * np.array([steps for _, steps, _ in states], np.float64)
        matter = np.full((2, len(states), N, 2), np.nan, np.float32)
        moving = np.zeros((len(states), 2, K, 4))
        for t, (living, _, numbers) in enumerate(states):
            split = 4 * living
            matter[:, t, :living] = numbers[:split].reshape(2, living, 2)
            moving[t] = numbers[split:].reshape(2, K, 4)
        pose, rates = moving[:, 0], moving[:, 1, :, :3]
        angle = unwrap(np.arctan2(pose[..., 3], pose[..., 2]), rates[..., 2], time)
        return States(
            time=time,
            object_id=owner.astype(np.int16),
            mass=mass.astype(np.float32),
            positions=matter[0],
            velocities=matter[1],
            poses=np.concatenate([pose[..., :2], angle[..., None]], axis=-1),
            rates=rates,
            solid_id=solids.astype(np.int16),
            solid_mass=solid_mass,
            solid_inertia=inertia,
            gravity=gravity,
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


def invariants(states: States, gravity: Sequence[float] | Floats) -> dict[str, Floats]:
    """What mechanics conserves in a closed system, at every frame.

    Sums run over particles born and rigid bodies, of mass m, inertia I (0 for
    particles, which are points here), position x, velocity v and spin w. Prescribed
    colliders, which have no mass, are left out; they and walls may change all but the
    mass. Elastic and internal energy are not in it.

    Parameters
    ----------
    states : States
        Of T frames.
    gravity : array_like, shape (2,)
        Acceleration g [m/s^2].

    Returns
    -------
    dict of str to ndarray of float64
        - mass (T,): sum m [kg]
        - momentum (T, 2): sum m v [kg m/s]
        - angular_momentum (T,): about the origin, sum m x x v + I w [kg m^2/s]
        - kinetic_energy (T,): sum m v^2 / 2 + I w^2 / 2 [J]
        - potential_energy (T,): - sum m g . x [J], 0 at the origin
        - center_of_mass (T, 2): sum m x / sum m [m], NaN where there is no mass
        - largest_speed (T,): max |v| [m/s], 0 where nothing moves
    """
    rigid = np.isfinite(states.solid_mass)
    mass = np.concatenate([states.mass, states.solid_mass[rigid]])
    here = np.ones((len(states.time), len(mass)), bool)
    here[:, : len(states.mass)] = states.born
    rows = []
    for t, there in enumerate(here):
        rates, places = states.rates[t, rigid], states.poses[t, rigid, :2]
        x = np.concatenate([states.positions[t], places])[there]
        v = np.concatenate([states.velocities[t], rates[:, :2]])[there]
        turning = states.solid_inertia[rigid] * rates[:, 2]
        rows.append(_sums(mass[there], x, v, turning, rates[:, 2], np.array(gravity)))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _sums(
    m: Floats, x: Floats, v: Floats, turning: Floats, spin: Floats, g: Floats
) -> dict[str, Any]:
    """The invariants of one frame, from angular momenta `turning` about centers."""
    momentum, moment = (m * v.T).sum(axis=1), (m * x.T).sum(axis=1)
    squares = (v * v).sum(axis=1)
    arm = m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
    with np.errstate(invalid="ignore"):  # 0 / 0 where there is no mass
        center = moment / m.sum()
    return {
        "mass": m.sum(),
        "momentum": momentum,
        "angular_momentum": arm.sum() + turning.sum(),
        "kinetic_energy": 0.5 * ((m * squares).sum() + (turning * spin).sum()),
        "potential_energy": -(moment * g).sum(),
        "center_of_mass": center,
        "largest_speed": np.sqrt(squares.max(initial=0.0)),
    }


def summary(states: States) -> dict[str, dict[str, Any]]:
    """Invariants at the first and the last frame, as plain numbers; None for NaN."""
    found = invariants(states, states.gravity)
    return {
        name: {"first": _plain(values[0]), "last": _plain(values[-1])}
        for name, values in found.items()
    }


def _plain(value: Floats) -> Any:
    if value.ndim:
        return [_plain(part) for part in value]
    return float(value) if np.isfinite(value) else None


def save_states(path: Path, states: States, dtype: Dtype = "float32") -> None:
    """Write states and their invariants, for `numpy.load`; equal states, equal bytes.

    The entries are the attributes of `States` and, as `invariants/mass` and so on, the
    invariants, which come from the states before they are rounded.

    Parameters
    ----------
    path : Path
        Compressed NumPy archive (.npz) to write, in one step.
    states : States
        What to write.
    dtype : {"float32", "float16"}
        Of positions and velocities. In half precision positions are within 0.25 mm,
        velocities within 0.05 % and, of slow particles, 3e-8 m/s.

    Raises
    ------
    ValueError
        If `dtype` is another.
    """
    if dtype not in get_args(Dtype):
        raise ValueError(f"dtype = {dtype!r}, must be one of {get_args(Dtype)}")
    arrays: dict[str, Any] = {f.name: getattr(states, f.name) for f in fields(States)}
    with np.errstate(over="ignore"):  # what is too fast for half precision is infinite
        for name in ("positions", "velocities"):
            arrays[name] = arrays[name].astype(dtype)
    found = invariants(states, states.gravity)
    arrays |= {f"invariants/{name}": values for name, values in found.items()}
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    write_atomically(path, file.getvalue())


def load_states(path: Path) -> States:
    """Read what `save_states` has written, in the dtypes of `States`.

    Raises
    ------
    ValueError
        If the file is something else.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {f.name: file[f.name] for f in fields(States)}
    except (EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise ValueError(
            f"{path}: is not a file of states ({error}); write one with "
            "`mpmworlds run scene.yaml --states states.npz`"
        ) from None
    for name in ("positions", "velocities"):
        arrays[name] = arrays[name].astype(np.float32)
    return States(**arrays)
