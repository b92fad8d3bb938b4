"""Angles: the same on every machine."""

import numpy as np


def unit(angle):
    """Cosine and sine of an angle [rad], rounded alike everywhere."""
    return np.round([np.cos(angle), np.sin(angle)], 12).tolist()


def turned(x, y, degrees):
    """Points in a frame turned counter-clockwise by degrees."""
    cos, sin = np.round([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))], 12)
    return cos * x + sin * y, cos * y - sin * x
