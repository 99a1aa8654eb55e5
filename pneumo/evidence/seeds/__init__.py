"""The study with other seeds of its random signals."""
