"""What the linker works with: sources, roles of objects, text, layout."""
