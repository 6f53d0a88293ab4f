"""Where each station stood: world_from_left."""
