"""Round columns: circle, silhouettes, top and foot."""
