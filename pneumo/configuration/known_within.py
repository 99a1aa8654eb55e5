"""Within which factor the wall's conductance of each cylinder is known."""

from pneumo.catalogue import coefficient_times_length
from pneumo.configuration.schema import Configuration

K_0_FACTOR = 2.0  # where nothing is said: as far apart as estimates of one wall are


def known_within(configuration: Configuration) -> dict[str, float]:
    """Return the factor within which k_0 is known, by cylinder.

    The cylinder's `k_0_factor`; without that the factor of the catalogue's interval where one of its
    experiments takes k_0 from there, else `K_0_FACTOR`.
    """
    of_catalogue = {e.cylinder for e in configuration.experiments.values() if e.k_0_W_per_K == "catalogue"}
    return {
        name: section.k_0_factor or (coefficient_times_length()[1] if name in of_catalogue else K_0_FACTOR)
        for name, section in configuration.cylinders.items()
    }
