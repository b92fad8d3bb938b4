"""Predictors, and the loop that evaluates them on a release."""
