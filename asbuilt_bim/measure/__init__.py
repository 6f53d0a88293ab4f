"""Pixels to metric faces with sigma; never sees the design."""
