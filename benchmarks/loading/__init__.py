"""What loading costs, and in which form it costs least."""
