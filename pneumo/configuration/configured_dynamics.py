"""Dynamics of a configured valve, beside the plant: only exports, linear models and fits use them."""

from pneumo.configuration.schema import Configuration
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics


def configured_dynamics(configuration: Configuration, cylinder: str) -> ValveDynamics:
    """Dynamics of a cylinder's valve; without such a section, a valve that follows its command at once."""
    section = configuration.cylinders[cylinder].valve_dynamics
    if section is None:
        return PROPORTIONAL
    return ValveDynamics(section.lag_s, section.dead_time_s, section.null_V, section.dead_band_V)
