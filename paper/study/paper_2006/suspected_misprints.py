"""Arguments for suspected misprints of 2006, from the results; ``paper/2006/errata.yaml`` names them."""

import sys

import xarray as xr

from paper.study import functions_returning
from paper.study.averages import at_n
from paper.study.paper_2006.numbers_of_tables import EXCHANGED, TOLERANCE_OF_N
from paper.study.paper_2006.printed_tables import percentiles, table5, table7, table8, table9
from paper.study.paper_2006.results import StudyResults
from paper.study.paper_2006.table_cells import number_at
from paper_verdict.errata import Proof
from paper_verdict.findings import MissingEvidence

ALIKE = 0.01  # deviation of a settling time that counts as agreement: the class `settling`


def columns_of_table_8(results: StudyResults) -> tuple[bool, str]:
    """Whether the columns M8 and M9 of Table 8 agree better with the results if they are exchanged.

    Both must improve: how many n equal the reproduced best n, and how near the mean errors at these n, over
    all experiments, are to Table 7.
    """
    printed, computed = table8().reset_coords(drop=True), results.statistics["best_n"]
    computed = computed.sel(experiment=printed["experiment"])
    equal: dict[str, int] = {}
    means: dict[str, list[float]] = {}
    for words, columns in {"printed": EXCHANGED, "exchanged": EXCHANGED[::-1]}.items():
        n = printed.sel(model=list(columns)).assign_coords(model=list(EXCHANGED))
        equal[words] = int((abs(computed.sel(model=list(EXCHANGED)) - n) < TOLERANCE_OF_N).sum())
        cells = at_n(results.cells.sel(experiment=n["experiment"], model=list(EXCHANGED)), n)
        means[words] = cells["mean_error"].mean("experiment", skipna=False).values.tolist()
    in_table_7 = table7()["mean_error"].sel(model=list(EXCHANGED)).values.tolist()

    def misfit(words: str) -> float:
        return sum(abs(mean - table) for mean, table in zip(means[words], in_table_7, strict=True))

    nearer = {words: [f"{mean:.0f}" for mean in values] for words, values in means.items()}
    shown = (
        f"n of M8 and M9 equal to ours: {equal['printed']} of {2 * computed.sizes['experiment']} as printed, "
        f"{equal['exchanged']} exchanged; mean errors at these n: {' and '.join(nearer['printed'])} Pa, "
        f"exchanged {' and '.join(nearer['exchanged'])} Pa, in Table 7 "
        f"{' and '.join(f'{mean:.0f}' for mean in in_table_7)} Pa"
    )
    better = equal["exchanged"] > equal["printed"] and misfit("exchanged") < misfit("printed")
    return better, shown


def row_of_M10(results: StudyResults) -> tuple[bool, str]:
    """Whether M10's isothermal row of Table 9 and its 90 % percentile are nearer to the reproduced M8.

    Nearer than to the reproduced M10: mean square error, mean error and percentile, all three.
    """
    level = "isothermal"
    printed, upper = table9().sel(level=level, model="M10"), percentiles(11)["p90"]
    row = {name: float(printed[name]) for name in ("mse", "mean_error")}
    row["p90"] = float(upper.sel(level=level, model="M10"))
    computed = {
        model: {name: number_at(results.statistics[name], level=level, model=model) for name in row}
        for model in ("M8", "M10")
    }
    nearer = [
        name for name in row if abs(computed["M8"][name] - row[name]) < abs(computed["M10"][name] - row[name])
    ]

    def words(numbers: dict[str, float]) -> str:
        mse, p90 = (f"{numbers[name] / 1e6:.1f}e6 Pa²" for name in ("mse", "p90"))
        return f"MSE {mse}, μ {numbers['mean_error']:.0f} Pa, 90 % {p90}"

    M8, M10 = words(computed["M8"]), words(computed["M10"])
    shown = f"printed for M10: {words(row)}; ours for M8: {M8}; for M10: {M10}"
    return len(nearer) == len(row), shown


def early_temperatures(results: StudyResults) -> tuple[bool, str]:
    """Whether, of E's closed-loop T_A and T_B settling times, only T_A of E04 and E08 is off by over 1 %."""
    printed: xr.DataArray = table5().reset_coords(drop=True)
    off = {
        f"{name} {quantity}": number_at(results.settling_times, experiment=name, quantity=quantity)
        / float(printed.sel(experiment=name, quantity=quantity))
        - 1
        for name in results.experiments("E", closed_loop=True)
        for quantity in ("T_A", "T_B")
    }
    beyond = [name for name, deviation in off.items() if abs(deviation) > ALIKE]
    shown = ", ".join(f"{name} {deviation:+.1%}" for name, deviation in off.items())
    return beyond == ["E04 T_A", "E08 T_A"], f"reproduced over printed: {shown}"


def _of_whole_study(argue: Proof) -> Proof:
    """An argument that is not to be judged by a study without the experiments that it needs."""

    def argue_or_miss(results: StudyResults) -> tuple[bool, str]:
        try:
            return argue(results)
        except KeyError as error:
            raise MissingEvidence(f"the results lack {error}") from None

    return argue_or_miss


ARGUMENTS: dict[str, Proof] = {
    name: _of_whole_study(argue)
    for name, argue in functions_returning(tuple[bool, str], sys.modules[__name__]).items()
}
