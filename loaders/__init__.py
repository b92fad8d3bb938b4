"""Releases as data for models: the bare name, examples, clips."""
