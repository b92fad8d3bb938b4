"""What code-writing models cost: tokens, and memory of the 7B model.

`python -m benchmarks.vlm tokens` counts over the seeds and every 401st row of the
corpus (needs the packages `tiktoken` and `dashscope`, which ships Qwen's vocabulary);
`python -m benchmarks.vlm memory` prints estimates, and needs nothing.
"""
