"""Releases in the forms that training scripts of others take."""
