"""Numbers of signal-sampling.md, from floor.nc."""

import xarray as xr
from fragments import span


def numbers(floor: xr.Dataset) -> dict[str, str]:
    """Theory, formula and M8 over the floor measured by replays: lowest and highest ratio by loop."""
    open_loop, on_D = floor["loop"] == "open", floor["cylinder"] == "D"
    measured = floor["measured"]
    formula = (floor["formula"] / measured).sel(period=slice(0, 2.5e-3))  # up to 2 ms
    by_rate, by_size = (floor[f"{name}_formula"] / floor[f"{name}_measured"] for name in ("rate", "size"))
    quotient = floor["own_predicted"] / floor["own_measured"]
    between = floor["between_measured"] / measured
    drifting = floor["between_formula"] / floor["between_measured"]

    def within(ratio: xr.DataArray, part: xr.DataArray) -> str:
        return span(ratio.where(part, drop=True), 2)

    return {
        "M8": span(floor["reduced"] / measured.sel(period=1e-3), 2),
        "own open": within(quotient, open_loop),
        "own closed": within(quotient, ~open_loop),
        "linear open": within(formula.sel(transport="linear"), open_loop),
        "held open": within(formula.sel(transport=["hold", "delay"]), open_loop),
        "slow open": within(by_rate.sel(rate=10), open_loop & on_D),
        "closed D": within(formula, ~open_loop & on_D),
        "closed E": within(formula, ~open_loop & ~on_D),
        "large valve": within(by_size.sel(size=4), ~open_loop & ~on_D),
        "fast": within(by_rate.sel(rate=100), ~open_loop & on_D),
        "between open": within(between, open_loop),
        "between closed": within(between, ~open_loop),
        "drifting": f"{drifting.max().item():.1f}",
    }
