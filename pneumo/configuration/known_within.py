"""How well the wall, the valve and the dead volumes of each cylinder are known."""

from typing import NamedTuple

from pneumo.catalogue import conductance_factor
from pneumo.configuration.conductance import CONVERSIONS, USUAL_B, uncertainty
from pneumo.configuration.schema import Configuration, CylinderSection

K_0_FACTOR = 2.0  # default: estimates of the same wall differ as much


class KnownWithin(NamedTuple):
    """Limits within which a cylinder differs from its configuration."""

    k_0_factor: float = K_0_FACTOR  #: the true k_0 lies between k_0 / factor and k_0 * factor
    valve: float = 0.0  #: largest relative error of the valve's flow
    dead_volumes: float = 0.0  #: largest relative error of both dead volumes


def known_within(configuration: Configuration) -> dict[str, KnownWithin]:
    """Limits of each cylinder, by its name.

    The factor of k_0 is the cylinder's `k_0_factor` if given; else, if one of its experiments takes k_0 from
    the catalogue, the factor of the catalogue's interval; else `K_0_FACTOR`. The valve's accuracy is its
    `valve_within_percent` if given; else that of the rule that converted its figures.
    """
    from_catalogue = {e.cylinder for e in configuration.experiments.values() if e.k_0_W_per_K == "catalogue"}
    return {
        name: KnownWithin(
            section.k_0_factor
            or (conductance_factor(section.bore_mm * 1e-3) if name in from_catalogue else K_0_FACTOR),
            _valve_within(section),
            (section.dead_volumes_within_percent or 0.0) / 100,
        )
        for name, section in configuration.cylinders.items()
    }


def _valve_within(section: CylinderSection) -> float:
    if section.valve_within_percent is None and section.valve:
        return uncertainty(section.valve.flow_as_given[0], section.valve.b)
    return (section.valve_within_percent or 0.0) / 100


def conversion_notes(configuration: Configuration) -> list[str]:
    """Sentences on the figures of valves that were converted, with rule and accuracy, and on a missing b."""
    notes = []
    for name, section in configuration.cylinders.items():
        if section.valve is None:
            continue
        key, value = section.valve.flow_as_given
        rule = CONVERSIONS[key]
        if key != "C_dm3_per_sbar":
            within = f", within {100 * rule.within:.0f} %" if rule.within else ""
            C = section.valve.C_dm3_per_sbar
            notes.append(f"{name}: {key} = {value:g} is C = {C:.4g} dm3/(s bar): {rule.rule}{within}")
        if section.valve.b is None:
            left = f"{name}: b is not given: {USUAL_B} assumed (0.2 to 0.5 are usual)"
            notes.append(f"{left}; pneumo study takes the flow as known within 10 %")
    return notes
