"""The only importer of ifcopenshell: reads the design, writes the result into a copy."""
