"""Speed and soundness of the metrics: `python -m benchmarks.metrics`."""
