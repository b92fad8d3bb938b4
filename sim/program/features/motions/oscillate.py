"""Harmonic motion."""

import math
from typing import Literal

import numpy as np
from pydantic import model_validator

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.features.motion import POSES, Motion, Pose
from mpmworlds.sim.program.words import (
    hook,
)
from mpmworlds.sim.scene.fields import Vec2, about


class Oscillate(Motion):
    """Harmonic motion along a line, about the center, or both, from rest position.

    After a time T it is at amplitude x (sin(2 pi f T + phase) - sin(phase)). At a phase
    of 90 or -90 degrees it starts from one end of its way, without a jerk.
    """

    type: Literal["oscillate"] = about("neutral", "kind of motion")
    amplitude: Vec2 = about(
        "position", "amplitude of place", "m", default=(0.0, 0.0), kind="displacement"
    )
    amplitude_deg: float = about(
        "neutral",
        "amplitude of turn",
        "deg",
        default=0.0,
        ge=-180.0,
        le=180.0,
        kind="swing",
    )
    frequency: float = about(
        "neutral", "cycles per time", "Hz", gt=0.0, le=50.0, kind="frequency"
    )
    phase_deg: float = about(
        "neutral",
        "phase at the start",
        "deg",
        default=0.0,
        ge=-360.0,
        le=360.0,
        kind="phase",
    )

    @model_validator(mode="after")
    def _moves(self) -> "Oscillate":
        if not (any(self.amplitude) or self.amplitude_deg):
            raise ValueError(
                "kinematics.amplitude and amplitude_deg are 0, one of them must differ "
                "from 0; a collider that rests is a static_collider"
            )
        return self

    def row(self) -> tuple[str, Numbers]:
        """Amplitudes, frequency and phase."""
        a, b = self.amplitude
        numbers = {"a": a, "b": b, "frequency": self.frequency, "phase": self.phase_deg}
        rocking = {"c": self.amplitude_deg} if self.amplitude_deg else {}
        kind = "rock" if rocking else "oscillate"
        name = f"{kind}_for_a_time" if self.is_timed() else kind
        return name, numbers | rocking | self.timing()

    def fastest(self, reach: float) -> float:
        """Speed in the middle of the swing."""
        swing = math.hypot(*self.amplitude)
        swing += math.radians(abs(self.amplitude_deg)) * reach
        return 2.0 * math.pi * self.frequency * swing

    def poses(self) -> list[Pose]:
        """Poses from one end of the swing to the other."""
        middle = -math.sin(math.radians(self.phase_deg))
        (x, y), turn = self.amplitude, math.radians(self.amplitude_deg)
        parts = np.linspace(middle - 1.0, middle + 1.0, POSES).tolist()
        return [((x * part, y * part), turn * part) for part in parts]


@hook.row
def oscillate(t, x, y, degrees, a, b, frequency, phase):
    cos, sin = unit(2 * np.pi * frequency * t + np.radians(phase))
    part, rate = sin - unit(np.radians(phase))[1], 2 * np.pi * frequency * cos
    cx, cy = x + a * part, y + b * part
    return cx, cy, *unit(np.radians(degrees)), a * rate, b * rate, 0.0


@hook.row
def oscillate_for_a_time(t, x, y, degrees, a, b, frequency, phase, start, stop):
    time, moving = min(max(t, start), stop) - start, float(start <= t < stop)
    cos, sin = unit(2 * np.pi * frequency * time + np.radians(phase))
    part, rate = sin - unit(np.radians(phase))[1], 2 * np.pi * frequency * cos
    cx, cy, rate = x + a * part, y + b * part, moving * rate
    return cx, cy, *unit(np.radians(degrees)), a * rate, b * rate, 0.0


@hook.row
def rock(t, x, y, degrees, a, b, c, frequency, phase):
    cos, sin = unit(2 * np.pi * frequency * t + np.radians(phase))
    part, rate = sin - unit(np.radians(phase))[1], 2 * np.pi * frequency * cos
    turn, spin = unit(np.radians(degrees + c * part)), np.radians(c * rate)
    return x + a * part, y + b * part, *turn, a * rate, b * rate, spin


@hook.row
def rock_for_a_time(t, x, y, degrees, a, b, c, frequency, phase, start, stop):
    time, moving = min(max(t, start), stop) - start, float(start <= t < stop)
    cos, sin = unit(2 * np.pi * frequency * time + np.radians(phase))
    part, rate = sin - unit(np.radians(phase))[1], 2 * np.pi * frequency * cos
    turn, rate = unit(np.radians(degrees + c * part)), moving * rate
    return x + a * part, y + b * part, *turn, a * rate, b * rate, np.radians(c * rate)
