"""Points that both photos of a station show, to be known again from another station."""
