"""What the study costs, measured: `make bench`. Outside the package, which needs nothing of it."""
