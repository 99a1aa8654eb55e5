"""Page of `pneumo rig`: one self-contained HTML file."""

from collections.abc import Mapping, Sequence

import xarray as xr

from pneumo.publish.figures.rig_figure import ranked, rig_figure
from pneumo.publish.pages.page import page_text
from pneumo.publish.style import image_address
from pneumo.publish.text.terminal_tables import ON_BOUND, RIG_ERRORS, RIG_ESTIMATES, rig_cells


def rig_page(
    result: xr.Dataset, name: str, warnings: Sequence[str], unphysical: Mapping[str, str], several: bool
) -> str:
    """Return the self-contained page of a rig's fit, from a `result` with replays of the record `name`.

    `unphysical` has a reason for each model that is not physical; `several`: the record has several runs.
    """
    errors, estimates = rig_cells(result)
    models = ranked(result)
    bounds = {
        model: [row[1] for row in estimates if row[0] == model and row[3] == ON_BOUND] for model in models
    }
    rows = [
        (
            row,
            "; ".join(
                [
                    *filter(None, [unphysical.get(row[0])]),
                    *(f"{name} on its bound" for name in bounds[row[0]]),
                ]
            ),
        )
        for row in errors
    ]
    return page_text(
        "rig.html.j2",
        name=name,
        best=models[0],
        error_heads=(*RIG_ERRORS, "not physical, or on a bound"),
        errors=rows,
        estimate_heads=RIG_ESTIMATES,
        estimates=estimates,
        warnings=warnings,
        several=several,
        few=not several and result.attrs["fitted_until"] >= result["t"].values[-1],
        picture=image_address(rig_figure(result), "png"),
    )
