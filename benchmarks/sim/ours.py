"""A linked program under the same protocol as `plain.py`: `ours.py PROGRAM`.

It answers each line on standard input, a number of substeps (a multiple of those of a
frame), with the seconds that they took without drawing.
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
    frame, each = program.simulate(), program.SIMULATION["substeps_per_frame"]
    frame.run({})
    print("ready", flush=True)
    for line in sys.stdin:
        start = time.perf_counter()
        for _ in range(int(line) // each):
            frame.run({})
        print(time.perf_counter() - start, flush=True)


if __name__ == "__main__":
    main()
