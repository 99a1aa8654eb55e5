"""What the claims are compared with: replace these functions by your reproduction of the paper.

A computation returns a `Finding`: a number, whether a statement holds, or a range. Its first argument is the
first of `sources` in judge.py, its others are `with` of the claim. `MissingEvidence` says that there is none.
"""

from typing import Any

from pneumo.verdict.sources import Finding

T_0, RATIO = 293.0, 1 / 7  # K; pressure at the end over that at the start


def left_in_chamber(air: dict[str, float], process: str, quantity: str) -> Finding:
    """Temperature or mass that is left, of an adiabatic or isothermal process."""
    n = air["gamma"] if process == "adiabatic" else 1.0
    left = {"temperature": T_0 * RATIO ** (1 - 1 / n), "mass_left": RATIO ** (1 / n)}
    return Finding(left[quantity])


def ends_below(air: dict[str, float], limit: float) -> Finding:
    """Whether the air ends below a temperature, K."""
    end = left_in_chamber(air, "adiabatic", "temperature").value
    assert end is not None
    return Finding(holds=end < limit, shown=f"{end:.0f} K")


def perfect_gas() -> tuple[bool, str]:
    """P V = m R T with the printed 0.25 of the mass: met by 168 K, not by 186 K."""
    good, bad = (0.25 * T / T_0 / RATIO for T in (168, 186))
    return abs(good - 1) < 0.02 < abs(bad - 1), f"m T / P is {good:.3f}, {bad:.3f}"


COMPUTATIONS: dict[str, Any] = {"left_in_chamber": left_in_chamber, "ends_below": ends_below}
PROOFS: dict[str, Any] = {"perfect_gas": perfect_gas}
