"""Linear models at an operating point: modes, stable steps, observability."""
