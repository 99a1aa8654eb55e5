"""Equations of one chamber and of the actuator, for floats, arrays and symbols."""
