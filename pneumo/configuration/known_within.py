"""How well the wall, the valve and the dead volumes of each cylinder are known."""

from typing import NamedTuple

from pneumo.catalogue import coefficient_times_length
from pneumo.configuration.schema import Configuration

K_0_FACTOR = 2.0  # default: estimates of the same wall differ as much


class KnownWithin(NamedTuple):
    """Limits within which a cylinder differs from its configuration."""

    k_0_factor: float = K_0_FACTOR  #: the true k_0 lies between k_0 / factor and k_0 * factor
    valve: float = 0.0  #: largest relative error of the valve's flow
    dead_volumes: float = 0.0  #: largest relative error of both dead volumes


def known_within(configuration: Configuration) -> dict[str, KnownWithin]:
    """Limits of each cylinder, by its name.

    The factor of k_0 is the cylinder's `k_0_factor` if given; else, if one of its experiments takes k_0 from
    the catalogue, the factor of the catalogue's interval; else `K_0_FACTOR`.
    """
    from_catalogue = {e.cylinder for e in configuration.experiments.values() if e.k_0_W_per_K == "catalogue"}
    return {
        name: KnownWithin(
            section.k_0_factor or (coefficient_times_length()[1] if name in from_catalogue else K_0_FACTOR),
            (section.valve_within_percent or 0.0) / 100,
            (section.dead_volumes_within_percent or 0.0) / 100,
        )
        for name, section in configuration.cylinders.items()
    }
