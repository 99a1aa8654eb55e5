"""Fits to closed chambers: wall conductance and thermal laws."""
