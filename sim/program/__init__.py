"""Programs: the features that scenes are made of, and the linker that writes them."""
