"""`python -m benchmarks.vlm tokens` or `memory`; prints the tables of vlm.md."""

import sys

from benchmarks.vlm.memory import memory
from benchmarks.vlm.tokens import tokens

VERBS = {"tokens": tokens, "memory": memory}

if len(sys.argv) != 2 or sys.argv[1] not in VERBS:
    sys.exit(f"python -m benchmarks.vlm {'|'.join(VERBS)}")
VERBS[sys.argv[1]]()
