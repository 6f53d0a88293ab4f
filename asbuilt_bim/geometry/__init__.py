"""Pure geometry: no pictures, no files, no design."""
