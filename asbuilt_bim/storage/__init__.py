"""What lies on the disk and how it is read: strict YAML and JSON, structure, whole writes, schemas, plugins."""
