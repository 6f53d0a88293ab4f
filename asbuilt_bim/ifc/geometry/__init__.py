"""Bodies of IFC products become faces: planes and cylinders."""
