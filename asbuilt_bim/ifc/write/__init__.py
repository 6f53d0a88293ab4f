"""The result into a copy of the IFC file, and out of it again."""
