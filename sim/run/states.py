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
from mpmworlds.sim.program.linking.cast import Cast, weights_of
from mpmworlds.sim.run.track import Track
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import spacing

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

    @classmethod
    def of(cls, scene: Scene, track: Track) -> "States":
        """States of a run of the program of a scene.

        Parameters
        ----------
        scene : Scene
            What was linked.
        track : Track
            What its program went through.
        """
        cast = Cast(scene)
        numbers = {id(thing): i for i, thing in enumerate(scene.objects)}
        matter = np.array([numbers[id(o)] for o in cast.matter], np.int16)
        solids = [*cast.rigid, *cast.movers, *cast.still]
        moving = len(cast.rigid + cast.movers)
        rest = np.array([(*o.shape.center, o.shape.angle()) for o in cast.still])
        rest = np.tile(rest.reshape(1, -1, 3), (len(track.time), 1, 1))
        densities = np.array([material.density for material in cast.materials])
        alike = densities.astype(np.float64)[track.owner] * spacing(scene) ** 2
        weights = np.full((len(solids), 2), np.inf)
        for k, thing in enumerate(cast.rigid):
            weights[k] = weights_of(thing)
        ids = np.array([numbers[id(o)] for o in solids], np.int16)
        order = np.argsort(ids)
        poses = np.concatenate([track.poses[:, :moving], rest], axis=1)
        rates = np.concatenate([track.rates[:, :moving], 0.0 * rest], axis=1)
        return cls(
            time=track.time,
            object_id=matter[track.owner],
            mass=np.where(np.isnan(track.mass), alike, track.mass).astype(np.float32),
            positions=track.positions,
            velocities=track.velocities,
            poses=poses[:, order],
            rates=rates[:, order],
            solid_id=ids[order],
            solid_mass=weights[order, 0],
            solid_inertia=weights[order, 1],
            gravity=np.array(scene.environment.gravity),
        )


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


def save_states(path: Path, states: States | Track, dtype: Dtype = "float32") -> None:
    """Write states and their invariants, for `numpy.load`; equal states, equal bytes.

    The entries are the attributes of `States` and, as `invariants/mass` and so on, the
    invariants, which come from the states before they are rounded. A track, of a
    program whose scene is not known, has no invariants.

    Parameters
    ----------
    path : Path
        Compressed NumPy archive (.npz) to write, in one step.
    states : States or Track
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
    arrays: dict[str, Any] = {f.name: getattr(states, f.name) for f in fields(states)}
    with np.errstate(over="ignore"):  # what is too fast for half precision is infinite
        for name in ("positions", "velocities"):
            arrays[name] = arrays[name].astype(dtype)
    if isinstance(states, States):
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
