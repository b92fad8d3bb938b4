"""One module for each of the motions."""
