"""Right-hand side of a replay on floats, and the size of its terms, at what an engineer gives."""

from readable_equations import lane_rate

from pneumo import MODELS, Model
from pneumo.physics.cylinder import Side, chamber_of, volume
from pneumo.physics.models import lane

OWN = Model("own", "n", "gamma", 1.1, "polytropic", True, "lambda_0 A_q")
EVERY = [*MODELS.values(), OWN]


def _outward(plant, side):
    return Side[side].sign, chamber_of(plant.cylinder, Side[side])


def plain_rate(model, n, plant, u, x, v, P, side):
    """Rate of a chamber's pressure, Pa/s, as the replays have it; u within the limiter."""
    sign, chamber = _outward(plant, side)
    return lane_rate(sign * u, sign * x, sign * v, P, chamber, plant, lane(model, n, plant.gas.gamma))


def rate_size(model, n, plant, u, x, v, P, side, heat=0.0):
    """Scale for rounding errors, Pa/s: compression and all the rest, before they cancel.

    Wall heat counts as if the air were `heat` kelvin off.
    """
    sign, chamber = _outward(plant, side)
    V = volume(sign * x, chamber, plant.cylinder)
    rest = abs(plain_rate(model, n, plant, u, x, 0 * v, P, side))
    return rest + plant.gas.gamma * P * chamber.area * abs(v) / V + heat * plant.k_0 / V
