"""Damage of a JPEG that a decoder passes over."""
