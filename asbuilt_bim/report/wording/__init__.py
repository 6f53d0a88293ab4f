"""All that the program says to people, in one place."""
