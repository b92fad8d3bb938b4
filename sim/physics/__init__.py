"""The only formulas of the solver: Taichi functions that programs are linked from."""
