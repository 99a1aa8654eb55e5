"""Linear models at an operating point, and a filter that estimates pressures."""
