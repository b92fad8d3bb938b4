"""Speed of examples."""
