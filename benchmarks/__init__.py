"""Measured cost of the study: `make bench`. Outside the package, which needs nothing of it."""
