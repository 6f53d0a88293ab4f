"""Work schedules given beside the IFC: MS Project XML, Primavera P6 XML, CSV; read, and linked to elements."""
