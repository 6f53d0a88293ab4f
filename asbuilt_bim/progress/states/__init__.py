"""Built, open or unknown: from the stations' evidence to samples and cells."""
