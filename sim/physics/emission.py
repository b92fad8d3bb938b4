"""Births of particles at a nozzle: times [s], places [m] and velocities [m/s].

Times are (n,), places and velocities (n, 2); places are relative to the center of the
nozzle. `emission` is the mapping that the scene has, `width` the extent of the nozzle
across its velocity [m], and `spacing` the distance of particles at rest [m].
"""

import numpy as np


def jet(emission, width, spacing):
    """Births of a steady jet, on a lattice over time and place across the nozzle.

    Places are multiples of the golden ratio, modulo 1: for any count and any width, no
    two particles are near to each other and no gap is wide (a Kronecker sequence).
    """
    n = np.arange(round(emission["rate"] * (emission["stop"] - emission["start"])))
    time = emission["start"] + (n + 0.5) / emission["rate"]
    velocity = np.tile(emission["velocity"], (len(n), 1))
    across = velocity[:, ::-1] * [-1, 1] / np.hypot(*emission["velocity"])
    part = n * (5**0.5 - 1) / 2 % 1 - 0.5
    return time, width * part[:, None] * across, velocity


def hose(emission, width, spacing):
    """Births of a jet whose nozzle swings to both sides in sinusoidal motion."""
    time, place, velocity = jet(emission, width, spacing)
    phase = 2 * np.pi * (time - emission["start"]) / emission["period"]
    angle = np.radians(emission["swing_deg"]) * np.sin(phase)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return time, *(np.einsum("ni,ijn->nj", each, turn) for each in (place, velocity))


def rain(emission, width, spacing):
    """Births of drops: discs of particles whose centers make a jet.

    In a drop, particles lie on a spiral with steps of the golden angle [Vogel 1979].
    """
    radius = emission["drop_radius"]
    count = max(round(np.pi * radius**2 / spacing**2), 1)
    part = np.arange(count) + 0.5
    far, angle = radius * np.sqrt(part / count), np.pi * (3 - 5**0.5) * part
    disc = np.stack([far * np.cos(angle), far * np.sin(angle)], axis=1)
    drops = dict(emission, rate=emission["rate"] / count)
    time, center, velocity = jet(drops, width - 2 * radius, spacing)
    place = (center[:, None] + disc).reshape(-1, 2)
    return time.repeat(count), place, velocity.repeat(count, axis=0)
