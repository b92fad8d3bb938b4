"""How scenes are made: composed of seeds, modified, perturbed."""
