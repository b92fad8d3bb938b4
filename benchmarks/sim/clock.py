"""CPU time of the processes that a benchmark starts."""

import resource


def children() -> float:
    """CPU seconds of all processes that have been started and waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
