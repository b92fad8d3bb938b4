"""One module for each of the materials."""
