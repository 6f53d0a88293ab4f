"""Disparity and depth, and the state of the rig that the photos show."""
