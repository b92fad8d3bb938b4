"""From a store to a release folder, and what proves it."""
