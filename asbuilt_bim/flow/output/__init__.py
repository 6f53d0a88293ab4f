"""Where results lie on the disk: a run whole or not at all, and what people open beside it."""
