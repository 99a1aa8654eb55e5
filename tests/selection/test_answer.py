"""The answer of `pneumo study`: choice, ties, sentences and next command, on cells known beforehand."""

import re
import shlex

import numpy as np
import pytest
from paper_study import STUDY
from ranked_cells import LEVEL, SWING, answered, made
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.export.step_cost import step_costs
from pneumo.physics.models import MODELS
from pneumo.publish.text.terminal_tables import contest_cells, contest_heads
from pneumo.selection.answer import Answer, answers, export_command, next_command, row_cost
from pneumo.statistics.intervals import paired_ratio
from pneumo.statistics.ranking import MATERIAL
from pneumo.statistics.robust_choice import FULL_ORDER, RobustModel

MUCH = 1e3  # an error of the full order that leaves it out of the contest


def row(name):
    return RobustModel(name, np.nan, (1.0, 1.0, 1.0))


def test_the_full_order_is_chosen_like_any_other_row():
    answer = answered(made(ends=(2.0, 4.0)))
    assert answer.chosen == answer.recommended == FULL_ORDER and answer.tied == ()
    assert [c.row.worst for c in answer.contenders] == sorted(c.row.worst for c in answer.contenders)
    assert len(answer.contenders) == len(MODELS) + 1
    assert answer.headline == "Recommended: full order"
    worst = (0.5e6 * 4) ** 0.5 / 1e3
    assert (
        f"at most {worst:.3g} kPa RMS error, {1e5 * worst / SWING:.2g} % of the pressures' swing"
        in answer.reason
    )
    assert "for k_0 from 0.15 to 0.6 W/K" in answer.reason
    assert (
        "Best reduced model: M6 at n = 1.3, at most 2.83 kPa" in answer.reason
        and "without k_0" not in answer.reason
    )
    assert "Best without k_0: M6 at n = 1.3, at most 2.83 kPa" in answered(made()).reason
    assert any("its own equations" in line and "pneumo fit" in line for line in answer.advice)
    assert not any("Measure k_0" in line for line in answer.advice)


def test_the_cheapest_row_within_the_limit_is_chosen_and_k_0_costs_most():
    near, far = 1 + 0.8 * MATERIAL, 1 + 1.2 * MATERIAL
    for level, chosen in (
        (LEVEL, "M9"),
        (LEVEL | {"M6": 2.4 * near}, "M6"),
        (LEVEL | {"M6": 2.4 * far, "M9": 3.5}, "M10"),
    ):
        assert answered(made(level, noise=1e-6, full=MUCH)).recommended == chosen
    answer = answered(made(LEVEL | {"M6": 2.4 * near}, noise=1e-6, full=MUCH))
    assert (
        "it needs no k_0 and is the cheapest within 10 % of the lowest worst mean square error"
        in answer.reason
    )
    # A full order that is as good as M7 costs less; one that is as good as M6 needs k_0.
    assert (
        answered(made(LEVEL | {"M10": 3, "M9": 3, "M8": 3}, noise=1e-6, full=3 * near)).recommended
        == FULL_ORDER
    )
    assert answered(made(LEVEL | {"M6": 2.41}, noise=1e-6, full=2.41 / near)).recommended == "M6"
    order = sorted((*MODELS, FULL_ORDER), key=lambda name: row_cost(row(name)))
    assert order.index("M6") < order.index(FULL_ORDER) < order.index("M7") < order.index("M8")


def test_the_order_of_cost_is_that_of_the_measured_instructions():
    costs = step_costs()
    assert costs["full"].instructions < costs["M7"].instructions < costs["M8"].instructions
    assert {contender.row.model: contender.step for contender in answered(made()).contenders} == {
        name: costs.get("full" if name == FULL_ORDER else name) for name in (*MODELS, FULL_ORDER)
    }


def test_rows_that_the_runs_do_not_tell_apart_are_a_tie_that_is_named(mine):
    level = LEVEL | {"M7": 3.02, "M8": 3.0, "M9": 9.0, "M10": 9.0}
    cells = made(level, runs=4, noise=1.0, full=MUCH)
    answer = answered(cells)
    assert (answer.chosen, answer.tied, answer.recommended) == ("M7", ("M8",), "")
    assert answer.headline == "Tie: M7 at n = 1.3, M8 at n = 1.3"
    assert (
        "M7 at n = 1.3 has at most " in answer.reason
        and "and costs least; the runs do not tell M8 from it" in answer.reason
    )
    assert any(line == "More seeds distinguish M7, M8: --seeds 16." for line in answer.advice)
    assert next_command(answer, mine, ["my.yaml"]) == "pneumo study my.yaml --seeds 16"
    both = mine._replace(experiments=mine.experiments | {"Y": mine.experiments["X"]})
    assert next_command(answer, both, ["my.yaml"]).endswith("my.yaml --experiment X --seeds 16")
    assert "CONFIGURATION.yaml --cylinder mine --seeds" in next_command(answer, mine)
    of_models = cells["mse"].sel(n=1.3).mean(("experiment", "chamber"))
    ratio = paired_ratio(of_models.sel(model="M8").values, of_models.sel(model="M7").values)
    assert answer.contender("M8").over_chosen == pytest.approx(ratio)
    assert ratio.low < 1 < ratio.high
    clear = answered(made(level, noise=1e-6, full=MUCH))
    assert (clear.recommended, clear.tied) == ("M7", ()) and "More seeds" not in " ".join(clear.advice)


def test_any_of_rows_that_are_known_to_be_alike_will_do(mine):
    cells = made(LEVEL | {"M7": 3.0, "M8": 3.0, "M9": 9.0, "M10": 9.0}, noise=0.02, full=MUCH)
    answer = answered(cells)
    assert (answer.chosen, answer.tied, answer.recommended, answer.more_seeds) == ("M7", ("M8",), "", 0)
    assert answer.advice[0].startswith("Any of M7, M8 will do: ") and "less than 10 %" in answer.advice[0]
    assert next_command(answer, mine, ["my.yaml"]) == export_command(answer, mine, ["my.yaml"]) != ""


def test_intervals_are_those_of_the_worst_case():
    cells = made(ends=(2.0, 4.0), full=MUCH)
    cells["mse_of_wrong_k_0"].loc[{"model": "M8", "k_0_end": "high", "run": 1}] *= 3
    answer = answered(cells)
    assert answer.chosen == "M6"
    worst = cells["mse_of_wrong_k_0"].sel(k_0_end="high", n=1.3).mean(("experiment", "chamber"))
    ratio = paired_ratio(worst.sel(model="M8").values, worst.sel(model="M6").values)
    assert answer.contender("M8").over_chosen == pytest.approx(ratio, rel=1e-6)


def test_a_valve_or_dead_volumes_that_are_not_known_count_like_k_0():
    cells = made(noise=1e-6, off_plant=(3.0, 2.0, 1.5, 4.0, 3.0, 2.0, 1.5, 1.0))
    answer = answered(cells)
    # The full order, best at every k_0, is as bad as M6 where valve or dead volumes are off; M9 is not.
    assert answer.recommended == "M9" and answer.contender(FULL_ORDER).row.rms[2] < 1e3
    full, M9 = answer.contender(FULL_ORDER).row, answer.contender("M9").row
    assert full.worst == max(full.off_plant) == pytest.approx((8e6 * 4) ** 0.5)
    assert np.argmax(M9.every) == 6 and answer.contender(FULL_ORDER).over_chosen.value == pytest.approx(
        3.2, 1e-3
    )
    ranges = "W/K, the valve within 3 % and dead volumes within 20 %, in every combination of their ends; "
    assert ranges in answer.reason
    (line,) = [line for line in answer.advice if line.startswith("Measure")]
    assert line.startswith("Measure valve and dead volumes, above all") and "instead of 3.1" in line
    heads = contest_heads(answer.ranking.unknown_k_0)
    assert heads[5] == "k_0, valve ± 3 %, V_d ± 20 %"
    shown = contest_cells(answer.contender("M9"), SWING)
    assert len(shown) == len(heads) and shown[5] == shown[6] > shown[4]
    # No column and no advice for dead volumes that are not said to be unknown.
    cells["dead_volumes_within"][:] = 0.0
    answer = answered(cells)
    assert contest_heads(answer.ranking.unknown_k_0)[5:7] == ["k_0, valve ± 3 %", "worst"]
    assert any(line.startswith("Measure valve, above all") for line in answer.advice)


def test_no_wider_grid_is_advised_beyond_isothermal_and_adiabatic():
    level = LEVEL | {"M6": 1.0}
    cells = made(level, best=1.4, noise=1e-6, full=MUCH)
    assert answered(cells).recommended == "M6"  # at 1.4, the last of the list
    assert not any("wider grid" in line for line in answered(cells).advice)
    cells["gamma"] = ("experiment", [1.6])
    assert any("wider grid" in line for line in answered(cells).advice)


def test_the_full_order_is_not_judged_by_its_own_runs():
    answer = answered(made(ends=(2.0, 4.0)))
    full, M9 = (contest_cells(answer.contender(name), SWING) for name in (FULL_ORDER, "M9"))
    assert full[3] == "" and "" not in M9


def test_one_run_decides_only_without_random_numbers(mine):
    cells = made(runs=1, full=MUCH)
    answer = answered(cells)
    assert (
        answer.chosen == "M9"
        and not answer.recommended
        and answer.headline.startswith("Undecided by one run")
    )
    assert any("one run of a random signal has no intervals" in line for line in answer.advice)
    assert next_command(answer, mine, ["my.yaml"]) == "pneumo study my.yaml --seeds 5"
    cells["random"][:] = 0
    assert answered(cells).recommended == "M9" and not any("seeds" in line for line in answered(cells).advice)


def test_no_sentence_compares_a_number_with_itself():
    for ends in ((1.0, 1.0), (1.05, 1.05), (2.0, 4.0)):
        for level in (LEVEL, LEVEL | {"M6": 2.5}):
            answer = answered(made(level, noise=1e-6, ends=ends, full=MUCH))
            for text in (answer.reason, *answer.advice):
                assert not re.search(r"([\d.]+ kPa)[^.;]* instead of \1", text), text
    (line,) = [
        line for line in answered(made(noise=1e-6, ends=(2, 4), full=MUCH)).advice if "Measure k_0" in line
    ]
    assert "1.55 kPa RMS instead of 2.83 kPa" in line
    calm = answered(made(noise=1e-6, ends=(1.05, 1.05), full=MUCH))
    assert any(line.startswith("k_0 is known well enough") for line in calm.advice)


def test_a_k_0_that_is_known_exactly_needs_no_advice_about_it():
    cells = made(noise=1e-6)
    cells["k_0_factor"][:] = 1.0
    cells["mse_of_full_order"][:] = 0.0  # the run itself
    answer = answered(cells)
    assert (
        answer.recommended == FULL_ORDER
        and "at most 0 kPa RMS error" in answer.reason
        and "at the given k_0" in answer.reason
    )
    several = made(experiments=("X", "Y"))
    several["k_0_factor"][:], several["k_0"][1] = 3.0, 0.5
    assert "where k_0 is known within a factor of 3" in answered(several).reason
    assert np.isinf(answer.contender("M10").over_chosen.value)
    cells["mse_of_full_order"][:] = MUCH * 1e6
    of_models = answered(cells)
    assert of_models.recommended == "M9" and not any("k_0" in line for line in of_models.advice)


def test_runs_that_failed_leave_no_answer():
    cells = made()
    cells["run_status"][:] = 1
    (answer,) = answers(cells)
    assert (
        answer.headline == "Recommended: none"
        and "no full-order run" in answer.reason
        and not answer.contenders
    )
    cells = made()
    for name in ("mse", "mse_of_wrong_k_0"):
        cells[name][:] = np.nan
    assert answered(cells).reason == "every model failed in a run"
    cells = made()
    cells["run_status"][0, 1] = 1
    cells["mse"][0, 1] = np.nan
    assert answered(cells).chosen == FULL_ORDER and answered(cells).ranking.runs == 3


def test_cells_of_earlier_code_have_no_full_order_and_no_swing():
    answer = answered(made(noise=1e-6).drop_vars(["mse_of_full_order", "swing"]))
    assert answer.chosen == "M9" and np.isnan(answer.swing) and "swing" not in answer.reason


def test_short_runs_narrow_grids_and_other_winners_are_named():
    cells = made(best=1.4, full=MUCH, experiments=("X", "Y"), noise=1e-6)
    cells["duration"][:] = 6.9
    cells["gamma"] = ("experiment", [1.6, 1.6])
    cells["mse"].loc[{"experiment": "Y", "model": "M1"}] = 1.0
    advice = " ".join(answered(cells).advice)
    assert "X lasts less than ten thermal time constants, 0.7 s" in advice
    assert "A wider grid: the best n of" in advice and "M10 in X, M1 in Y" in advice
    calm = " ".join(answered(made(noise=1e-6)).advice)
    assert "Longer" not in calm and "wider" not in calm and "More seeds" not in calm


@pytest.fixture
def mine():
    (e,) = [STUDY.experiments["E06"]]
    return STUDY._replace(experiments={"X": e._replace(cylinder="mine")})


def test_the_next_command_exports_the_chosen_row(mine):
    answer: Answer = answered(made(noise=1e-6, full=MUCH))
    command = export_command(answer, mine, ["my plant.yaml", "quick.yaml"])
    files = "--config 'my plant.yaml' --config quick.yaml"
    assert command == f"pneumo export M9 --n 1.3 --to c {files} -o m9.c"
    assert (
        export_command(answered(made()), mine, ["my.yaml"])
        == "pneumo export full --to c --config my.yaml -o full.c"
    )
    e = mine.experiments["X"]
    others = {"X": e, "Y": e._replace(plant=e.plant._replace(k_0=2.5)), "Z": e._replace(cylinder="other")}
    command = export_command(answer, mine._replace(experiments=others), ["my.yaml"])
    assert f"--cylinder mine --k0 {e.plant.k_0:g} " in command
    assert "--config CONFIGURATION.yaml --cylinder mine" in export_command(answer, mine)
    cells = made()
    cells["run_status"][:] = 1
    assert export_command(answers(cells)[0], mine) == ""


def test_the_next_command_runs(tmp_path, monkeypatch, mine):
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["init", "my.yaml"]).exit_code == 0
    for cells, name in ((made(noise=1e-6, full=MUCH), "m9.c"), (made(), "full.c")):
        done = CliRunner().invoke(app, shlex.split(export_command(answered(cells), mine, ["my.yaml"]))[1:])
        assert done.exit_code == 0, done.output
        assert (tmp_path / name).exists()
