"""Run the simulated example of 2007 in every reading; gather its measured coefficients; draw both."""

from pathlib import Path

from paper.study.figures import conductance_figures
from paper.study.paper_2007.coefficient_trend import trend
from paper.study.paper_2007.results import Results
from paper.study.paper_2007.simulated_example import example
from pneumo.jobs.wrapper import run_job
from pneumo.publish.style import save
from pneumo.storage.files import attributes, read, write


def main(claims: Path, response: Path, coefficients: Path, svg: list[Path]) -> None:
    summary = "A closed chamber pushed to mid-stroke, and what the seven steps make of it, by reading"
    write(example(), response, attributes("Simulated example", summary, "none"))
    summary = "Heat transfer coefficients over volume by area: measured, predicted, quoted, studied in 2006"
    trends = trend(Results(response.parent, claims.parent))
    write(trends, coefficients, attributes("Coefficients of cylinders", summary, "none"))
    drawn = {"simulated_example": response, "coefficients": coefficients}
    for figure in svg:
        draw = getattr(conductance_figures, figure.stem)
        save(draw(read(drawn[figure.stem])), figure.with_suffix(""))


run_job(main, globals())
