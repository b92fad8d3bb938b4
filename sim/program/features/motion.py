"""What prescribed motions have in common.

The module of a motion has hooks that return a row of a mover at time t [s]: its center
x, y [m]; cosine and sine of its angle; velocity [m/s] and spin [rad/s]. They take x, y,
degrees of the shape at rest, the `numbers` of the motion, and start and stop if timed.
"""

from typing import TYPE_CHECKING

from pydantic import ValidationInfo, field_validator

from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.scene.fields import Part, about

Pose = tuple[tuple[float, float], float]  # displacement [m] and turn [rad]
REST: Pose = ((0.0, 0.0), 0.0)
POSES = 25  # looked at along the way of a motion that turns
FOREVER = 100.0  # [s]; no scene lasts longer


class Timed(Part):
    """What lasts from one time to another."""

    start: float = about(
        "neutral", "when it starts", "s", default=0.0, ge=0, le=FOREVER, kind="time"
    )
    stop: float = about(
        "neutral", "when it stops", "s", gt=0.0, le=FOREVER, kind="time"
    )

    @field_validator("stop")
    @classmethod
    def _order(cls, stop: float, info: ValidationInfo) -> float:
        start = info.data.get("start", 0.0)
        if stop <= start:
            raise ValueError(f"must be > start = {start}")
        return stop


class Motion(Timed):
    """What every motion has; it lasts forever unless it is told to stop."""

    if TYPE_CHECKING:
        type: str

    stop: float = about(
        "neutral",
        "when it stops",
        "s",
        default=FOREVER,
        gt=0.0,
        le=FOREVER,
        kind="time",
    )

    def row(self) -> tuple[str, Numbers]:
        """Name and numbers of the hook that gives the row of a mover."""
        raise TypeError(f"{type(self).__name__} has no row")

    def is_timed(self) -> bool:
        """Whether it does not go on all the time."""
        return self.start > 0.0 or self.stop < FOREVER

    def timing(self) -> Numbers:
        """Start and stop, if it is timed."""
        return {"start": self.start, "stop": self.stop} if self.is_timed() else {}

    def fastest(self, reach: float) -> float:
        """Largest speed [m/s] of a point within a reach [m] of the center."""
        raise TypeError(f"{type(self).__name__} has no speed")

    def poses(self) -> list[Pose]:
        """Displacements that together show how far the motion leads."""
        raise TypeError(f"{type(self).__name__} has no poses")
