"""Time the linker over the seeds, in CPU time: `python benchmarks/link.py`."""

import statistics
import time

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link

ROUNDS = 15


def main() -> None:
    """Print the median time and the length of each seed's program."""
    for name, scene in load_seeds().items():
        link(scene)  # reads and parses the library once
        times = []
        for _ in range(ROUNDS):
            start = time.process_time()
            program = link(scene)
            times.append(1e3 * (time.process_time() - start))
        lines = program.count("\n")
        print(f"{name:>22}  {statistics.median(times):6.1f} ms  {lines} lines")


if __name__ == "__main__":
    main()
