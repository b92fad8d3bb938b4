"""One module for each of the shapes."""
