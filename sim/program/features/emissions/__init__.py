"""One module for each of the emissions."""
