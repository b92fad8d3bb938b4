"""The colours that objects may have: each one survives the release codec exactly.

About one RGB colour in six comes back unchanged from RGB -> BT.601 limited range
YUV 4:4:4 -> RGB. These are the survivors nearest to 24 evenly spaced hues at one
strong brightness, to the same hues at a deep one, and three greys
(``benchmarks/palette.py`` finds them; ``tests/sim/test_palette.py`` sends them through
the codec). Every colour has a channel of at least 128, so none is mistaken for the
black background.
"""

import re
from colorsys import rgb_to_hsv
from types import MappingProxyType
from typing import Final

BACKGROUND: Final = "#000000"

PALETTE: Final = MappingProxyType(
    {
        "red": "#F52D2C",
        "vermilion": "#F45F2D",
        "orange": "#F4912C",
        "amber": "#F5C22D",
        "yellow": "#F5F42C",
        "lime": "#C2F62C",
        "chartreuse": "#90F52D",
        "leaf": "#5EF52C",
        "green": "#2CF52D",
        "emerald": "#2BF55F",
        "mint": "#2CF591",
        "turquoise": "#2CF5C3",
        "cyan": "#2CF4F4",
        "sky": "#2DC2F4",
        "azure": "#2C90F5",
        "cobalt": "#2C5FF4",
        "blue": "#2C2DF5",
        "indigo": "#5E2BF5",
        "violet": "#912CF4",
        "purple": "#C32CF5",
        "magenta": "#F52CF4",
        "orchid": "#F42CC2",
        "rose": "#F52C90",
        "crimson": "#F52D5E",
        "deep_red": "#A81919",
        "deep_vermilion": "#A83E19",
        "deep_orange": "#A96019",
        "deep_amber": "#A88619",
        "deep_yellow": "#A9A919",
        "deep_lime": "#85A818",
        "deep_chartreuse": "#61A81A",
        "deep_leaf": "#3DA819",
        "deep_green": "#19A919",
        "deep_emerald": "#19A83D",
        "deep_mint": "#19A961",
        "deep_turquoise": "#19A885",
        "deep_cyan": "#19A9A8",
        "deep_sky": "#1985A9",
        "deep_azure": "#1961A9",
        "deep_cobalt": "#1A3DA8",
        "deep_blue": "#1A19A9",
        "deep_indigo": "#3E19A9",
        "deep_violet": "#6019A8",
        "deep_purple": "#8419A8",
        "deep_magenta": "#A819A7",
        "deep_orchid": "#A81985",
        "deep_rose": "#A81960",
        "deep_crimson": "#A8193E",
        "white": "#FFFFFF",
        "silver": "#C8C8C8",
        "grey": "#969696",
    }
)

_HEX = re.compile(r"#[0-9A-Fa-f]{6}")
_VALUES = frozenset(PALETTE.values())


def rgb(color: str) -> tuple[int, int, int]:
    """Return the red, green and blue parts of a ``#RRGGBB`` colour.

    Parameters
    ----------
    color
        Seven characters, ``#`` and six hexadecimal digits of either case.

    Returns
    -------
    tuple of int
        Three values of 0..255.

    Raises
    ------
    ValueError
        If the text has another form.
    """
    if not _HEX.fullmatch(color):
        raise ValueError(
            f"colour {color!r} must be '#' and six hexadecimal digits, like '#F4912C'"
        )
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def is_exact(color: str) -> bool:
    """Tell whether a ``#RRGGBB`` colour is in the palette (letter case is ignored).

    Raises
    ------
    ValueError
        If the text is not a ``#RRGGBB`` colour.
    """
    rgb(color)
    return color.upper() in _VALUES


def nearest(color: str) -> str:
    """Return the palette colour at the least Euclidean RGB distance.

    Parameters
    ----------
    color
        Any ``#RRGGBB`` colour.

    Returns
    -------
    str
        A ``#RRGGBB`` palette colour; the earlier in the palette of two equally near.

    Raises
    ------
    ValueError
        If the text is not a ``#RRGGBB`` colour.
    """
    wanted = rgb(color)

    def distance(candidate: str) -> int:
        return sum((a - b) ** 2 for a, b in zip(rgb(candidate), wanted, strict=True))

    return min(PALETTE.values(), key=distance)


def name_of(color: str) -> str:
    """Return the name of the palette colour nearest to a ``#RRGGBB`` colour."""
    exact = nearest(color)
    return next(name for name, value in PALETTE.items() if value == exact)


def hue_deg(color: str) -> float:
    """Return the HSV hue of a ``#RRGGBB`` colour in [deg], 0 <= hue < 360; greys: 0."""
    return 360.0 * rgb_to_hsv(*rgb(color))[0]


def hue_difference(one: str, other: str) -> float:
    """Return how far two ``#RRGGBB`` colours are apart in hue [deg], 0 to 180."""
    apart = abs(hue_deg(one) - hue_deg(other))
    return min(apart, 360.0 - apart)


def saturation(color: str) -> float:
    """Return the HSV saturation of a ``#RRGGBB`` colour, 0 (grey) to 1."""
    return rgb_to_hsv(*rgb(color))[1]


def luma(color: str) -> float:
    """Return the BT.601 luma of a ``#RRGGBB`` colour, 0 (black) to 255."""
    red, green, blue = rgb(color)
    return 0.299 * red + 0.587 * green + 0.114 * blue
