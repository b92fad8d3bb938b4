"""The constants of the metric definitions, one version for all of them."""

from dataclasses import asdict, dataclass
from typing import Final

VERSION: Final = "mpmworlds-metrics/1"


@dataclass(frozen=True)
class Constants:
    """Every number that the metric definitions leave to the implementer.

    Colours are 8-bit RGB; chromaticity is ``c / sum(c)``, brightness is
    ``max(c) / 255``, both in [0, 1]. Changing a value is a new `VERSION`.
    """

    foreground_level: int = 32
    """A pixel is foreground when its largest channel exceeds this value."""
    tiles_per_side: int = 4
    """`wmae` and `anomaly` divide the image into this many tiles per side."""

    collapse_min_region_px: int = 25
    """Smallest region of the early frame [pixels]."""
    collapse_merge_chromaticity: float = 0.05
    """Regions closer than this in mean chromaticity (L2) may be one region."""
    collapse_merge_brightness: float = 0.15
    """Regions closer than this in mean brightness may be one region."""
    collapse_area_chromaticity: float = 0.05
    """A pixel within this chromaticity (L2) of a region may belong to it."""
    collapse_area_brightness: float = 0.25
    """A pixel within this brightness of a region may belong to it."""
    collapse_event: float = 0.5
    """A sample has collapsed at the first time its loss exceeds this value."""

    wmae_luma: tuple[int, int, int] = (299, 587, 114)
    """Luma weights of R, G and B in thousandths (ITU-R BT.601)."""
    wmae_window: int = 8
    """Length of the centred moving average [frames]."""
    wmae_epsilon: float = 1e-8
    """Added to the denominator, so that two still clips score 0."""

    color_tv_bins: int = 8
    """Histogram bins per RGB channel (a power of two)."""

    anomaly_hue_bins: int = 8
    """Histogram bins over the hue circle."""
    anomaly_saturation_bins: int = 4
    """Histogram bins over saturation."""
    anomaly_value_bins: int = 4
    """Histogram bins over value."""
    anomaly_window: int = 3
    """Frames averaged on each side of a time."""
    anomaly_excess: float = 0.25
    """Largest excess jump of a clip that is not anomalous."""

    semd_directions: int = 32
    """Projection directions, at angles ``pi * k / semd_directions``."""

    bootstrap_resamples: int = 10_000
    """Resamples of the families behind an interval."""
    bootstrap_confidence: float = 0.95
    """Coverage of the interval."""


CONSTANTS: Final = Constants()


def definition() -> dict[str, object]:
    """Return the version and all constants, as written into every result file.

    Returns
    -------
    dict
        ``version`` and one entry per field of `Constants`; JSON-serialisable.
    """
    return {"version": VERSION, **asdict(CONSTANTS)}
