"""Page of `pneumo fit`: one self-contained HTML file."""

from pneumo.fitting.fit_result import AS_STATED, FitResult
from pneumo.publish.figures.fit_figures import residual_figure
from pneumo.publish.pages.page import page_text
from pneumo.publish.style import image_address
from pneumo.publish.text.fit_text import answer_text, next_experiments
from pneumo.publish.text.terminal_tables import RIG_HEADS, RIG_TITLE, fit_heads, fit_rows, rig_rows

# Class and symbol of a light.
LIGHT_LOOKS = {
    "green": ("scatter", "✓"),
    AS_STATED: ("agrees", "="),
    "yellow": ("explained", "≈"),
    "red": ("contradicted", "!"),
}


def fit_page(fit: FitResult, name: str) -> str:
    """Return the page of a fit of the measurement `name`: table, figures and notes, nothing from outside."""
    return page_text(
        "fit.html.j2",
        name=name,
        headings=fit_heads(fit),
        closed=fit.closed,
        rows=fit_rows(fit),
        rig=rig_rows(fit),
        rig_headings=RIG_HEADS,
        rig_title=RIG_TITLE,
        samples=fit.data.sizes["t"],
        duration=f"{fit.data['t'].values[-1]:.4g}",
        held_out_from=f"{fit.held_out_from:.4g}",
        warnings=fit.warnings,
        notes=fit.notes,
        answer=answer_text(fit),
        experiments=next_experiments(fit),
        lights=LIGHT_LOOKS,
        pressures=image_address(residual_figure(fit)),
    )
