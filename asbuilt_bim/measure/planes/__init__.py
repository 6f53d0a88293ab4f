"""The plane of each face, on the pixels of both photos."""
