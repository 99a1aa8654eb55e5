"""Numbers of a rig: one table of their names, units, bounds, accuracies and keys, and how they act."""
