"""Linear models at an operating point: modes and stable steps."""
