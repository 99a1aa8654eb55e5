"""Sonic conductance of a valve from the figures that catalogues print, and the area that has it."""

from typing import NamedTuple

from pneumo.physics.valve import AIR, Gas, choked_flow, mass_flow, sonic_coefficient

ANR_T, ANR_RHO = 293.15, 1.185  # K, kg/m^3: air in the reference atmosphere of ISO 6358 and ISO 8778
SBAR = 1e-8  # 1 dm^3/(s bar) in m^3/(s Pa)
UPSTREAM, DOWNSTREAM = 7.0, 6.0  # bar absolute: from 6 to 5 bar on the gauge, as in European catalogues
SECONDS = 60.0  # in a minute
USUAL_B = 0.3  # where a catalogue has no b
NORMAL = 293.15 / 273.15 * 1.01325  # litres at 20 degC and 1 bar in a normal litre: DIN 1343, ISO 8778
# l/min at 20 degC and 1 bar from 7 to 6 bar. NFPA T3.21.3: 22.48 Cv sqrt((P_1 - P_2) P_2 / T) standard cubic
# feet a minute (psi, degrees Rankine): 984 l/min at 1 atm, of 60 or 68 degF by different makers.
Q_N_PER_CV = 984.0 * 1.01325
KV_PER_CV = 0.865  # (m^3/h) / (US gallon a minute), each per root of its unit of pressure (IEC 60534-1)


class Conversion(NamedTuple):
    """How one key of a valve gives its sonic conductance."""

    to_C: float  #: dm^3/(s bar) of one unit; for a nominal flow, l/min at 20 degC and 1 bar of one unit
    nominal: bool  #: whether the figure is a flow from 7 to 6 bar, which is converted with b
    within: float  #: accuracy of the rule, relative
    rule: str


CONVERSIONS = {
    "C_dm3_per_sbar": Conversion(1.0, False, 0.0, "ISO 6358"),
    "Q_n_l_per_min": Conversion(
        1.0, True, 0.0, "from 7 to 6 bar by ISO 6358, litres at 20 degC and 1 bar (ANR)"
    ),
    "Q_nN_l_per_min": Conversion(
        NORMAL, True, 0.0, "from 7 to 6 bar by ISO 6358, litres at 0 degC and 1.01325 bar (DIN 1343)"
    ),
    "C_m3_per_sPa": Conversion(1e8, False, 0.0, "ISO 6358"),
    "C_l_per_minbar": Conversion(1 / SECONDS, False, 0.0, "ISO 6358, litres as in ISO 8778 (ANR)"),
    "S_mm2": Conversion(1 / 5.0, False, 0.05, "C = S / 5; an ideal nozzle has S / 5.02"),
    "Cv": Conversion(
        Q_N_PER_CV, True, 0.15, "NFPA's gas formula, 984 l/min at 1 atm from 7 to 6 bar for Cv = 1"
    ),
    "Kv_m3_per_h": Conversion(Q_N_PER_CV / KV_PER_CV, True, 0.15, "Cv = Kv / 0.865, then as Cv"),
}


def conductance(key: str, value: float, b: float) -> float:
    """Sonic conductance C, dm^3/(s bar), from a key of `CONVERSIONS`, its value, and the critical ratio b.

    By ISO 6358 a nominal flow is C P_u sqrt(1 - ((P_d/P_u - b)/(1 - b))^2), in litres of its reference
    atmosphere (20 degC, 1 bar).
    """
    conversion = CONVERSIONS[key]
    if not conversion.nominal:
        return value * conversion.to_C
    gas = AIR._replace(critical_ratio=b, elliptic=True)
    at = 1.0, UPSTREAM, DOWNSTREAM, ANR_T  # area and temperature cancel
    fraction = mass_flow(*at, gas) / choked_flow(1.0, UPSTREAM, ANR_T, gas)
    return value * conversion.to_C / (SECONDS * UPSTREAM * fraction)


def in_series(C_1: float, C_2: float, b: float) -> tuple[float, float]:
    """Conductance and critical ratio of two restrictions of the same b, air passing the first one first.

    ISO 6358-3: the conductance is exact, from the sonic flow of the second or the first; with the critical
    ratio, flows at a small drop of pressure are right.
    """
    if b * C_2 >= C_1:  # sonic in the first
        C = C_1
    else:
        d, stiff = (1 - b) ** 2, 1 + ((1 - b) * C_2 / C_1) ** 2
        between = (b + (b**2 - stiff * (b**2 - d)) ** 0.5) / stiff  # pressure between them, over that before
        C = C_2 * between
    return C, 1 - C**2 * (1 - b) * (1 / C_1**2 + 1 / C_2**2)


def area_per_conductance(gas: Gas) -> float:
    """Area, m^2, that has the choked flow of air by eq (1) of a sonic conductance C of 1 dm^3/(s bar).

    By ISO 6358 the choked flow of a conductance C is C rho_ref P_u sqrt(T_ref/T_u), with air. The area stays
    with another gas. A sonic coefficient that was given in place of the exact one scales that of air too.
    """
    of_air = gas.sonic_coefficient * (AIR.sonic_coefficient / sonic_coefficient(gas.R, gas.gamma))
    return SBAR * ANR_RHO * ANR_T**0.5 / of_air
