"""Computations with which the claims of each paper are compared."""
