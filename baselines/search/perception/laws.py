"""Laws of prescribed motions, fitted to poses."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.pixels import rotation
from mpmworlds.baselines.search.perception.poses import Poses
from mpmworlds.baselines.search.perception.simplex import descend

Floats = npt.NDArray[np.floating[Any]]
Data = dict[str, Any]

FREQUENCIES: Final = np.geomspace(0.2, 8.0, 60)  # [Hz]
# What a law of more freedom must be nearer to the poses by [px].
HANDICAP: Final = {"rotate": 0.0, "translate": 0.0, "oscillate": 0.05}
QUARTER: Final = 90.0  # phases are multiples of it, mostly [deg]
SNAP: Final = 0.03  # worse fit that a phase of that kind is worth [px]
STILL: Final = 0.6  # pixels of motion that are none


@dataclass(frozen=True)
class Law:
    """A motion that explains poses."""

    kinematics: Data
    """Plain data, without a stop if it goes on at the end."""
    error: float
    """Root mean square distance from the poses [px]."""
    pivot: tuple[float, float]
    """Displacement of the place about which it turns from the shape's center [m]."""
    ongoing: bool
    """Whether it is seen to move until the end."""


def laws_of(poses: Poses, frame_time: float, reach: float, side: int) -> list[Law]:
    """Laws that explain poses, the likeliest first.

    Parameters
    ----------
    poses
        Poses of a collider.
    frame_time
        Simulated time between two of them [s].
    reach
        Radius of the shape, by which turns count as distances [m].
    side
        Pixels per side.
    """
    problem = _Problem(poses, frame_time, reach, side)
    found = [law for law in problem.laws() if law is not None]
    return sorted(
        found, key=lambda law: law.error + HANDICAP[str(law.kinematics["type"])]
    )


def amplitude_of(
    poses: Poses, frame_time: float, frequency: float, phase: float
) -> list[float]:
    """Amplitude [m] of an oscillation of known frequency [Hz] and phase [deg]."""
    time = frame_time * np.arange(len(poses))
    part = _swung(time, frequency, phase)
    found = (part @ poses.shift) / max(float(part @ part), 1e-12)
    return [float(v) for v in found]


class _Problem:
    def __init__(
        self, poses: Poses, frame_time: float, reach: float, side: int
    ) -> None:
        self.time = frame_time * np.arange(len(poses))
        self.shift, self.turn = poses.shift, poses.turn
        self.reach, self.side = max(reach, 0.02), side
        self.frame_time = frame_time
        self.pivot: Floats = np.zeros(2)
        if np.abs(self.turn).max() > 0.05:
            self.pivot = self._pivot()

    def laws(self) -> Iterator[Law | None]:
        turned = np.abs(self.turn).max() * self.reach * self.side
        moved = np.abs(self.shift).max() * self.side
        if turned > STILL:
            yield self._rotate()
            yield self._oscillate(about=self.pivot)
        if moved > STILL:
            yield self._translate()
            yield self._oscillate(about=None)
        if turned > STILL and moved > STILL:
            yield self._rock()

    def _pivot(self) -> Floats:
        """Place, from the center, that does not move: s = p - R p."""
        rows = [np.eye(2) - rotation(turn) for turn in self.turn]
        found = np.linalg.lstsq(np.vstack(rows), self.shift.ravel(), rcond=None)[0]
        far = np.linalg.norm(found)
        return np.zeros(2) if far * self.side < 1.0 else found

    def _error(self, shift: Floats, turn: Floats) -> float:
        off = (self.shift - shift) ** 2
        turned = (self.reach * (self.turn - turn)) ** 2
        return float(np.sqrt((off.sum(axis=1) + turned).mean())) * self.side

    def _about(self, turn: Floats, pivot: Floats) -> Floats:
        """Displacements of the center by turns about a place."""
        return np.array([pivot - rotation(t) @ pivot for t in turn])

    def _rotate(self) -> Law:
        slope, start, stop = _ramp(self.turn[:, None], self.time)
        turn = slope[0] * _progress(self.time, start, stop)
        ongoing = stop >= self.time[-1] - 2 * self.frame_time
        data: Data = {"type": "rotate", "angular_velocity": float(slope[0])}
        if start > 0.0:
            data["start"] = start
        if not ongoing:
            data["stop"] = stop
        error = self._error(self._about(turn, self.pivot), turn)
        return Law(data, error, _pair(self.pivot), ongoing)

    def _translate(self) -> Law:
        slope, start, stop = _ramp(self.shift, self.time)
        shift = slope * _progress(self.time, start, stop)[:, None]
        ongoing = stop >= self.time[-1] - 1.5 * self.frame_time
        data: Data = {
            "type": "translate",
            "velocity": slope.tolist(),
            "start": start,
        }
        if not ongoing:
            data["stop"] = stop
        error = self._error(shift, np.zeros_like(self.turn))
        return Law(data, error, (0.0, 0.0), ongoing)

    def _oscillate(self, about: Floats | None) -> Law | None:
        """Harmonic turns about a place, or along a line if there is none."""
        values = self.shift if about is None else self.turn[:, None]
        frequency, amplitude, phase = _best_harmonic(values, self.time)
        found = self._swing(about, frequency, amplitude, phase)
        snapped = QUARTER * round(phase / QUARTER)
        part = _swung(self.time, frequency, snapped)
        straight = (part @ values) / max(float(part @ part), 1e-12)
        neat = self._swing(about, frequency, straight, snapped)
        chosen = neat if neat.error < found.error + SNAP else found
        return chosen if frequency * self.time[-1] > 0.1 else None

    def _rock(self) -> Law | None:
        """Harmonic motion along a line and about the center at once."""
        values = np.column_stack([self.shift, self.reach * self.turn])
        frequency, amplitude, phase = _best_harmonic(values, self.time)
        if frequency * self.time[-1] < 0.1:
            return None
        part = _swung(self.time, frequency, phase)
        turn = amplitude[2] / self.reach
        error = self._error(np.outer(part, amplitude[:2]), turn * part)
        data: Data = {
            "type": "oscillate",
            "frequency": frequency,
            "phase_deg": float(math.remainder(phase, 360.0)),
            "amplitude": amplitude[:2].tolist(),
            "amplitude_deg": float(np.degrees(turn)),
        }
        return Law(data, error + 2 * SNAP, (0.0, 0.0), True)

    def _swing(
        self, about: Floats | None, frequency: float, amplitude: Floats, phase: float
    ) -> Law:
        part = _swung(self.time, frequency, phase)
        data: Data = {
            "type": "oscillate",
            "frequency": frequency,
            "phase_deg": float(math.remainder(phase, 360.0)),
        }
        if about is None:
            data["amplitude"] = amplitude.tolist()
            error = self._error(np.outer(part, amplitude), np.zeros_like(self.turn))
            return Law(data, error, (0.0, 0.0), True)
        data["amplitude_deg"] = float(np.degrees(amplitude[0]))
        turn = amplitude[0] * part
        return Law(
            data, self._error(self._about(turn, about), turn), _pair(about), True
        )


def _pair(v: Floats) -> tuple[float, float]:
    return float(v[0]), float(v[1])


def _progress(time: Floats, start: float, stop: float) -> Floats:
    return np.clip(time, start, stop) - start


def _swung(time: Floats, frequency: float, phase: float) -> Floats:
    offset = math.radians(phase)
    swung: Floats = np.sin(2 * np.pi * frequency * time + offset) - math.sin(offset)
    return swung


def _ramp(values: Floats, time: Floats) -> tuple[Floats, float, float]:
    """Slope (k,), start and stop of the ramp nearest to values (n, k)."""

    def slope(start: float, stop: float) -> tuple[float, Floats]:
        u = _progress(time, start, stop)
        k = (u @ values) / max(float(u @ u), 1e-12)
        return float(((values - np.outer(u, k)) ** 2).mean()), k

    end = float(time[-1])
    best = (*slope(0.0, end), 0.0, end)
    simple = best
    for i, start in enumerate(time[:-3]):
        for stop in time[i + 2 :]:
            cost, k = slope(float(start), float(stop))
            if cost < best[0]:
                best = (cost, k, float(start), float(stop))
    frame = float(time[1] - time[0])
    _, x = descend(
        lambda v: slope(max(v[0], 0.0), max(min(v[1], end), v[0] + frame))[0],
        [best[2], best[3]],
        [-0.5 * frame, -0.5 * frame],
        80,
    )
    start, stop = max(float(x[0]), 0.0), min(float(x[1]), end)
    cost, k = slope(start, max(stop, start + frame))
    if simple[0] < cost + 1e-7:  # a third of a pixel
        return simple[1], simple[2], simple[3]
    return k, start if start > 0.3 * frame else 0.0, max(stop, start + frame)


def _best_harmonic(values: Floats, time: Floats) -> tuple[float, Floats, float]:
    """Frequency [Hz], amplitudes (k,) and phase [deg] nearest to values (n, k)."""
    found = min((_harmonic(values, time, f) for f in FREQUENCIES), key=lambda h: h[0])
    _, x = descend(
        lambda v: _harmonic(values, time, float(v[0]))[0],
        [found[1]],
        [0.05 * found[1]],
        40,
    )
    _, frequency, amplitude, phase = _harmonic(values, time, float(x[0]))
    return frequency, amplitude, phase


def _harmonic(
    values: Floats, time: Floats, frequency: float
) -> tuple[float, float, Floats, float]:
    """Cost, frequency, amplitudes (k,) and phase [deg] nearest to values (n, k)."""
    angle = 2 * np.pi * frequency * time
    columns = np.stack([np.sin(angle), np.cos(angle) - 1.0], axis=1)
    both = np.linalg.lstsq(columns, values, rcond=1e-6)[0]  # (2, k)
    u, s, v = np.linalg.svd(both)
    amplitude, phase = s[0] * v[0], math.degrees(math.atan2(u[1, 0], u[0, 0]))
    part = _swung(time, frequency, phase)
    cost = float(((values - np.outer(part, amplitude)) ** 2).mean())
    # A slow swing of a long way explains anything that is smooth.
    cost += 1e-4 * max(float(np.linalg.norm(amplitude)) - 0.6, 0.0)
    return cost, frequency, amplitude, phase
