"""Trains the label model: windows of clips, losses, steps, what is kept of them."""
