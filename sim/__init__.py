"""Scenes, the programs that simulate them, and their exact videos."""
