"""Photos: read, held against the rig and against each other, before any pixel is trusted."""
