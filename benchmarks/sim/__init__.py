"""Speed of the simulator: `python -m benchmarks.sim`."""
