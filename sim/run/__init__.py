"""Running programs: processes of their own, their frames, states and videos."""
