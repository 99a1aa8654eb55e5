"""Statistics over experiments: averages, best n and intervals."""
