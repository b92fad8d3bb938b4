"""Scenes: their schema, the rules that they obey, and their YAML."""
