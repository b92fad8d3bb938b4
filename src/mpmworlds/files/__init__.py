"""Files that survive crashes: atomic writes, locks, journals, scratch, checksums."""
