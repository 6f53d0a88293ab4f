"""A station placed by the design itself: what it measured is looked for among the design's faces."""
