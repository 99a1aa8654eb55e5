"""Factor within which the wall conductance of each cylinder is known."""

from pneumo.catalogue import coefficient_times_length
from pneumo.configuration.schema import Configuration

K_0_FACTOR = 2.0  # default: estimates of the same wall differ as much


def known_within(configuration: Configuration) -> dict[str, float]:
    """Factor within which k_0 is known, by cylinder: the true k_0 lies between k_0 / factor and k_0 * factor.

    This is the cylinder's `k_0_factor` if given; else, if one of its experiments takes k_0 from the
    catalogue, the factor of the catalogue's interval; else `K_0_FACTOR`.
    """
    from_catalogue = {e.cylinder for e in configuration.experiments.values() if e.k_0_W_per_K == "catalogue"}
    return {
        name: section.k_0_factor or (coefficient_times_length()[1] if name in from_catalogue else K_0_FACTOR)
        for name, section in configuration.cylinders.items()
    }
