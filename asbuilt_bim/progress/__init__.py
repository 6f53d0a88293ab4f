"""Built, open, unknown; completion of elements, storeys, tasks; what it is worth."""
