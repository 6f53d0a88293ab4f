"""The flow on one screen, one visit, one pair; what a run reads and leaves."""
