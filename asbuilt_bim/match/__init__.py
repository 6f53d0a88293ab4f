"""Measured faces to design faces; nothing is lost."""
