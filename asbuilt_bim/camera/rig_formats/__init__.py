"""Rig files, ours and those of other programs, read and written."""
