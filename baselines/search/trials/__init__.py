"""What must be tried by simulation: materials, walls, gravity, numbers."""
