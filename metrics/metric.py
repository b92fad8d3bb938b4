"""What a metric is: a definition, its curve, and which way is good."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.view import View

Compare = Callable[[Clip | View, Clip | View], float]
CompareCurve = Callable[[Clip | View, Clip | View], Curve]
Judge = Callable[[Clip | View], float]
JudgeCurve = Callable[[Clip | View], Curve]


@dataclass(frozen=True)
class Metric:
    """One metric; each module of `mpmworlds.metrics.definitions` has one or two."""

    function: Compare | Judge
    """The metric: of (pred, ref), or of (pred) where `needs_reference` is false."""
    curve: CompareCurve | JudgeCurve
    """Its values per frame or per time, with the same arguments. The last one belongs
    to the last frame, the others to those before."""
    direction: Literal["up", "down"]
    """Which way is better."""
    worst: float
    """Value that a failed candidate scores."""
    best: float
    """Value of the truth itself."""
    column: int
    """Place among the columns of a table."""
    paper_name: str = ""
    """Name in the paper's tables; empty if the paper does not report it."""
    needs_reference: bool = True
    """Whether the reference is an argument."""
    anchored: bool = False
    """Whether the anchored score is an average over it, too."""
    selected_by: str = ""
    """Name of the metric that chooses among candidates for it; empty for itself."""
    bound: Callable[[View, View], float] | None = None
    """Best value that a prediction can still reach, of its first frames and the whole
    reference; None if that may be any."""

    @property
    def name(self) -> str:
        """Name in code and in result files: that of the function."""
        return self.function.__name__

    def __call__(self, pred: Clip | View, ref: Clip | View) -> float:
        """Compute the metric, leaving out the reference if it takes none."""
        return self.function(*((pred, ref) if self.needs_reference else (pred,)))

    def curve_of(self, pred: Clip | View, ref: Clip | View) -> Curve:
        """Compute its curve, leaving out the reference if it takes none."""
        return self.curve(*((pred, ref) if self.needs_reference else (pred,)))

    def best_of_begun(self, begun: View, ref: View) -> float:
        """Best value that a prediction can still reach whose first frames are known."""
        return self.best if self.bound is None else self.bound(begun, ref)

    def is_better(self, a: float, b: float) -> bool:
        """Return whether value a is strictly better than value b."""
        return a > b if self.direction == "up" else a < b
