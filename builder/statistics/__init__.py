"""The corpus in numbers, beside those of the paper."""
