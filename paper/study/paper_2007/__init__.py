"""Computations of the paper of 2007: wall heat of cylinders, measured by the thermal time constant."""
