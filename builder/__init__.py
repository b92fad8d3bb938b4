"""From seed scenes to a manifest, and from a manifest to a verified release."""
