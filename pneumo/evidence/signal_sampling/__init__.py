"""Error caused by signal sampling: theory, measurement, error budget."""
