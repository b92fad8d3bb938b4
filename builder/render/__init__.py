"""From rows of a manifest to videos in a store."""
