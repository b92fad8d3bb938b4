"""What a case is, and what it finds: checks and plots."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Check:
    """One quantity of a simulation, held against a reference.

    Attributes
    ----------
    quantity : str
        What it is, with its unit.
    observed : float
        What the simulation has.
    reference : str
        What it should be.
    error, tolerance : float
        How far it is from that, and how far it may be.
    source : str
        Where the reference comes from.
    """

    quantity: str
    observed: float
    reference: str
    error: float
    tolerance: float
    source: str

    @property
    def ok(self) -> bool:
        """Whether the error is within the tolerance; that of a NaN is not."""
        return self.error <= self.tolerance


def near(
    quantity: str,
    observed: float,
    reference: float,
    tolerance: float,
    source: str,
    scale: float | None = None,
) -> Check:
    """Check that a quantity is its reference, within a part of the scale.

    The scale is the reference itself unless another is given.
    """
    unit = abs(reference) if scale is None else scale
    error = abs(float(observed) - reference) / unit
    return Check(
        quantity, float(observed), f"{reference:.4g}", error, tolerance, source
    )


def at_most(quantity: str, observed: float, bound: float, source: str) -> Check:
    """Check that a quantity does not exceed a bound."""
    error = _excess(float(observed) - bound)
    return Check(quantity, float(observed), f"<= {bound:.4g}", error, 0.0, source)


def at_least(quantity: str, observed: float, bound: float, source: str) -> Check:
    """Check that a quantity reaches a bound."""
    error = _excess(bound - float(observed))
    return Check(quantity, float(observed), f">= {bound:.4g}", error, 0.0, source)


def _excess(value: float) -> float:
    return math.nan if math.isnan(value) else max(value, 0.0)


@dataclass(frozen=True)
class Curve:
    """Points (x, y) of a plot; what is not simulated is drawn as markers."""

    label: str
    x: npt.ArrayLike
    y: npt.ArrayLike
    reference: bool = False


@dataclass(frozen=True)
class Plot:
    """Curves that share their axes."""

    title: str
    x_label: str
    y_label: str
    curves: list[Curve]


@dataclass(frozen=True)
class Result:
    """What a case has found."""

    checks: list[Check]
    plots: list[Plot] = field(default_factory=list)


@dataclass(frozen=True)
class Case:
    """A simulation to run and what to expect of it.

    Attributes
    ----------
    name : str
        The property that it shows.
    solve : callable
        Runs it with so many cells per side.
    coarse, fine : int
        Cells per side in tests and in the benchmark.
    slow : bool
        Whether it takes tests long.
    """

    name: str
    solve: Callable[[int], Result]
    coarse: int
    fine: int
    slow: bool


CASES: dict[str, Case] = {}


def case(
    coarse: int, fine: int, *, slow: bool = False
) -> Callable[[Callable[[int], Result]], Callable[[int], Result]]:
    """Enter a function of the cells per side as the case of its name."""

    def enter(solve: Callable[[int], Result]) -> Callable[[int], Result]:
        name = solve.__name__
        CASES[name] = Case(name, solve, coarse, fine, slow)
        return solve

    return enter
