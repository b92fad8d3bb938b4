"""Program search: from the frames of a prefix to scenes that draw them."""
