"""How often the intervals of a fit contain the truth."""
