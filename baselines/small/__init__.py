"""A small label model: frames are flat colours, so labels of them are predicted."""
