"""The constants of the metric definitions, one version for all of them."""

from dataclasses import asdict, dataclass
from typing import Final

VERSION: Final = "mpmworlds-metrics/2"


@dataclass(frozen=True)
class Constants:
    """Every number that the metric definitions leave to the implementer.

    Colours are 8-bit RGB; chromaticity is `c / sum(c)`, brightness is `max(c) / 255`,
    both in [0, 1]. Changing a value is a new `VERSION`; others may be tried by handing
    them to a `mpmworlds.metrics.View`.
    """

    foreground_level: int = 32
    """A pixel is foreground when its largest channel exceeds this value."""
    tiles_per_side: int = 4
    """`wmae` and `anomaly` divide the image into this many tiles per side."""

    collapse_bins: int = 16
    """Bins per RGB channel in which the commonest colour is looked for."""
    collapse_min_region_px: int = 25
    """Smallest connected piece of a region of the early frame [pixels]."""
    collapse_min_core_px: int = 9
    """Least that a 3 x 3 erosion must leave of a region: fringes are none [pixels]."""
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
    wmae_dead_band: int = 24
    """A change of luma up to this is no motion but noise, of a codec say [levels]."""
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
    anomaly_windows: tuple[int, ...] = (1, 3)
    """Frames averaged on each side of a time, for local jumps."""
    anomaly_local_px: int = 64
    """Added to the foreground of a tile: what is small jumps easily [pixels]."""
    anomaly_colour_px: int = 200
    """Added to the area of a colour, likewise [pixels]."""
    anomaly_slack: int = 4
    """A jump of the reference excuses those so many frames before and after it."""
    anomaly_excess: float = 0.55
    """Largest excess jump of a clip that is not anomalous."""

    semd_directions: int = 16
    """Projection directions, at angles `pi * k / semd_directions`."""

    bootstrap_resamples: int = 10_000
    """Resamples of the families behind an interval."""
    bootstrap_confidence: float = 0.95
    """Coverage of the interval."""
    bootstrap_min_families: int = 10
    """Families below which the interval would cover too little and is left out."""


CONSTANTS: Final = Constants()


def definition() -> dict[str, object]:
    """Return the version and all constants, as written into every result file.

    Returns
    -------
    dict
        `version` and one entry per field of `Constants`; JSON-serialisable.
    """
    return {"version": VERSION, **asdict(CONSTANTS)}
