"""Training of a LoRA by flow matching, on the continuation alone."""
