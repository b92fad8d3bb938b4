"""Steady jets."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.emission import Emission
from mpmworlds.sim.scene.fields import about


class Jet(Emission):
    """A jet of particles that leaves the nozzle evenly in space and time."""

    type: Literal["jet"] = about("neutral", "kind of emission", default="jet")


def jet(width, spacing, rate, velocity, start, stop):
    """Times, places and velocities of a steady jet, by steps of the golden ratio."""
    n = np.arange(round(rate * (stop - start)))
    u, v = velocity
    part = width * (n * (np.sqrt(5) - 1) / 2 % 1 - 0.5) / np.sqrt(u * u + v * v)
    place = np.stack([-v * part, u * part], axis=1)
    return start + (n + 0.5) / rate, place, np.tile(velocity, (len(n), 1))
