"""A rectified pair in, pixels that mean something out."""
