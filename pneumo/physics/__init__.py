"""The paper's equations: valve, cylinder, chamber, equilibrium and the reduced models."""
