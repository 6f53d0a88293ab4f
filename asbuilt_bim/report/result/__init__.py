"""`result.json` and `measure.json`, written, read and described."""
