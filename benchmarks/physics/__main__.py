"""Run the cases of the physics benchmark and write a table and plots.

python -m benchmarks.physics                              # all, minutes
python -m benchmarks.physics --out physics --jobs 2       # and write table and plots
python -m benchmarks.physics --only dam sand --coarse     # as tests run them
"""

import argparse
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.physics import CASES
from benchmarks.physics.case import Case, Result
from benchmarks.physics.report import draw, table


def main() -> int:
    """Run cases, print the table, and return 1 if a check fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="folder for physics.md and plots")
    parser.add_argument("--only", nargs="+", help="cases whose name has one of these")
    parser.add_argument("--jobs", type=int, default=1, help="simulations at a time")
    parser.add_argument("--coarse", action="store_true", help="on the cells of tests")
    options = parser.parse_args()
    words = options.only or [""]
    cases = [case for case in CASES.values() if any(w in case.name for w in words)]
    if not cases:
        parser.error(f"no case is named like {words}; there are {', '.join(CASES)}")

    def solve(case: Case) -> Result:
        start = time.perf_counter()
        result = case.solve(case.coarse if options.coarse else case.fine)
        seconds = time.perf_counter() - start
        verdict = "ok" if all(check.ok for check in result.checks) else "FAILED"
        print(f"{case.name}: {verdict}, {seconds:.0f} s", file=sys.stderr, flush=True)
        return result

    with ThreadPoolExecutor(max(1, min(options.jobs, os.cpu_count() or 1))) as pool:
        results = dict(zip(cases, pool.map(solve, cases), strict=True))
    text = table(results, coarse=options.coarse)
    print(text)
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        options.out.joinpath("physics.md").write_text(text, "utf-8")
        for case, result in results.items():
            if result.plots:
                draw(result.plots, options.out / f"{case.name}.png")
    checks = [check for result in results.values() for check in result.checks]
    return 0 if all(check.ok for check in checks) else 1


if __name__ == "__main__":
    sys.exit(main())
