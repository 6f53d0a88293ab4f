"""Draws training pictures, and trains and exports the networks that asbuilt_bim ships."""
