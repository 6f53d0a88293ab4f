"""From cells to elements, storeys, tasks and cost lines."""
