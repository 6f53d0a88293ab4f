"""Tables beside the IFC that a person fills in: costs and observations, and the empty ones to begin with."""
