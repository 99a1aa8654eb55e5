"""Which model for a cylinder: plants, runs, rankings, error budget."""
