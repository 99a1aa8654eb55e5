"""Page of `pneumo fit`: one self-contained HTML file."""

import xarray as xr

from pneumo.publish.figures.fit_figures import held_out_figure, residual_figure
from pneumo.publish.pages.page import page_text
from pneumo.publish.style import image_address
from pneumo.publish.text.terminal_tables import fit_heads, fit_rows, valve_text, wall_text, warning_texts


def fit_page(fit: xr.Dataset, name: str) -> str:
    """Return the page of a fit of the measurement `name`: table, figures and notes, nothing from outside."""
    return page_text(
        "fit.html.j2",
        name=name,
        headings=fit_heads(fit),
        closed="closed_chambers" in fit.attrs,
        rows=fit_rows(fit),
        samples=fit.sizes["t"],
        duration=f"{fit['t'].values[-1]:.4g}",
        held_out_from=f"{fit.attrs['held_out_from']:.4g}",
        warnings=warning_texts(fit),
        valve=valve_text(fit) or wall_text(fit),
        notes=[note for note in str(fit.attrs["notes"]).split("\n") if note],
        pressures=image_address(residual_figure(fit), "png"),
        ranking=image_address(held_out_figure(fit), "png"),
    )
