"""One module for each of the contacts."""
