"""What the paper says: valve, cylinder, chamber, reduced models and their parameters."""
