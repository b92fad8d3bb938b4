"""Continuation by video diffusion: given frames and a text, the frames that follow."""
