"""Construction sites with exact truth: scenes, two renderers, and what is really built (development only)."""
