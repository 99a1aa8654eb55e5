"""Which model for a cylinder: plants, runs, the ranking for one cylinder."""
