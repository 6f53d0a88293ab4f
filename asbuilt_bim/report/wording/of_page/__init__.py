"""Words that the page alone uses."""
