"""What the label model costs, and how its training went."""
