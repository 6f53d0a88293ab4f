"""The design as plain data: elements, faces, storeys, tasks, cost lines."""
