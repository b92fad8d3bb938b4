"""How fast a gallery of ten thousand samples is in a browser."""
