"""One photo read as surfaces: planes, round columns, floors, bars, sky."""
