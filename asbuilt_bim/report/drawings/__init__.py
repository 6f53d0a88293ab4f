"""Pictures: overlays, figures, plots."""
