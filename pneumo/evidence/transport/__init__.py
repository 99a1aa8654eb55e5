"""Error caused by the sampling of signals: theory, measurement, error budget."""
