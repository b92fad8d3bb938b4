"""What learned baselines have in common: settings, notes of checkpoints, devices."""
