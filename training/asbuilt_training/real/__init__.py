"""Holds the networks against real photographs: our polygons over others' pictures, and laser depth."""
