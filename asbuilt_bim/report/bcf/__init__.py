"""BCF files: what a person has to look at, with the element, the real camera and the picture."""
