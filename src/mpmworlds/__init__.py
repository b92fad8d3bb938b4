"""MPMWorlds: 2D Material Point Method worlds as programs, scenes and videos."""

__version__ = "0.1.0"
