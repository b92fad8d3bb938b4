"""The definitions: one module each, with its curve, direction, worst and best value."""
