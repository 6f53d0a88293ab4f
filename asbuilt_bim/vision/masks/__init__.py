"""Instances: who found them, what they hold, where their borders lie."""
