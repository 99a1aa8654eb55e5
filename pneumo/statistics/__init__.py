"""Statistics over experiments: averages, best n, rankings and their intervals."""
