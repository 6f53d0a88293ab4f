"""An IFC file becomes the design as plain data."""
