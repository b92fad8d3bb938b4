"""Measure the metrics and print tables as Markdown.

python -m benchmarks.metrics clips --of mini_train    render what to study (long)
python -m benchmarks.metrics speed                    all metrics of one pair
python -m benchmarks.metrics study                    false alarms and misses
python -m benchmarks.metrics sweep                    constants and the ranking
"""

import argparse
from pathlib import Path

from benchmarks.metrics import clips, speed, study, sweep


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("clips", "speed", "study", "sweep"))
    parser.add_argument("--folder", type=Path, default=Path("work/clips"))
    parser.add_argument("--of", default="mini_train", help="a list, or seeds")
    parser.add_argument("--count", type=int, help="only so many clips, evenly chosen")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    if given.what == "clips":
        clips.make(given.of, given.folder, given.count, given.workers)
        return
    pairs = list(clips.read(given.folder))
    if not pairs:
        parser.error(f"{given.folder}: no clips; render some with 'clips'")
    if given.count:
        pairs = pairs[:: max(1, len(pairs) // given.count)][: given.count]
    tables = {"speed": speed.table, "study": study.table, "sweep": sweep.table}
    print(tables[given.what](pairs))


if __name__ == "__main__":
    main()
