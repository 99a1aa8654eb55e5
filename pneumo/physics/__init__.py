"""What the paper says: valve, cylinder, chamber, equilibrium and the reduced models."""
