"""Rig files, this program's and others', read and written."""
