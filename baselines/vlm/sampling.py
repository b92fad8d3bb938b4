"""How replies are drawn."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sampling:
    """How many replies are drawn, and how."""

    candidates: int = 15
    """Replies to a question; the paper takes the best of 15."""
    samples_per_call: int = 5
    """Replies that are written at once; what fits depends on it."""
    temperature: float = 1.0
    """Of the distribution that tokens are drawn from; 0 takes the likeliest ones."""
    top_p: float = 0.95
    """Share of the distribution that is drawn from."""
    max_new_tokens: int = 8192
    """Where a reply is cut off; see benchmarks/vlm.md for what programs take."""
    seed: int = 0
    """Which draws."""

    def __post_init__(self) -> None:
        for name in ("candidates", "samples_per_call", "max_new_tokens"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} = {getattr(self, name)}, must be at least 1")
        if self.temperature < 0 or not 0 < self.top_p <= 1:
            raise ValueError(
                f"temperature = {self.temperature}, top_p = {self.top_p}: must be >= "
                "0, and in (0, 1]"
            )
        if self.temperature == 0 and self.candidates > 1:
            raise ValueError(
                f"temperature = 0 with candidates = {self.candidates}: all are the "
                "same; set candidates = 1, or a temperature"
            )

    def calls(self) -> list[int]:
        """Number of replies of each call."""
        whole, rest = divmod(self.candidates, self.samples_per_call)
        return [self.samples_per_call] * whole + [rest] * (rest > 0)
