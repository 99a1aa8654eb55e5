"""Named gases: gas constant and ratio of specific heats of the ideal gas.

R is 8.314462618 J/(mol K) (CODATA 2018) over the molar mass (IUPAC 2021; dry air 28.9652 g/mol, ISO 2533).
The ratio is that of the ideal gas at 293 K: NIST Chemistry WebBook (SRD 69), Shomate equations; of air, 1.4.
"""

from pneumo.physics.valve import Gas, exact_gas

GASES: dict[str, Gas] = {
    "air": exact_gas(287.05, 1.4),
    "nitrogen": exact_gas(296.80, 1.4),
    "helium": exact_gas(2077.3, 5 / 3),
    "hydrogen": exact_gas(4124.5, 1.405),
    "argon": exact_gas(208.13, 5 / 3),
    "CO2": exact_gas(188.92, 1.291),
}
