"""Where each face ends: sides, corners, openings, and what proves them."""
