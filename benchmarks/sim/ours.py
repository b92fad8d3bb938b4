"""A linked program under the same protocol as `plain.py`: `ours.py PROGRAM`.

It answers each line on standard input, a number of substeps, with the seconds that they
took without drawing. Nothing may move in the scene but matter, so that a step needs no
time.
"""

import importlib.util
import sys
import time


def main() -> None:
    """Answer each number of substeps with the seconds they take."""
    spec = importlib.util.spec_from_file_location("program", sys.argv[1])
    if spec is None or spec.loader is None:
        raise SystemExit(f"{sys.argv[1]} is no program")
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    next(program.frames())
    program.substep()
    print("ready", flush=True)
    for line in sys.stdin:
        start = time.perf_counter()
        for _ in range(int(line)):
            program.substep()
        print(time.perf_counter() - start, flush=True)


if __name__ == "__main__":
    main()
