"""Constants that the paper leaves open, identified from its tables."""
