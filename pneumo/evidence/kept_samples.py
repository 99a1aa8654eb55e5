"""Samples of the kept evidence, computed again: in a minute on a fresh clone, where the files took hours.

Some are runs and fits made again, others follow from numbers in the same file or in another. `SAMPLES` has a
function for each file.
"""

import json
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.configuration.parameters import load, read_yaml, study
from pneumo.evidence import measured_air as air
from pneumo.evidence.at_work import partly_known
from pneumo.evidence.at_work import plant_at_work as work
from pneumo.evidence.at_work.at_work_statistics import at_work_statistics
from pneumo.evidence.fit_coverage.interval_coverage import FIRST_SEED, fit_same_model
from pneumo.evidence.identification import open_loop_cells as open_loop
from pneumo.evidence.identification.open_loop import penalty
from pneumo.evidence.identification.settling_stops import identified_stop
from pneumo.evidence.kept_copies import difference, tolerance
from pneumo.evidence.random_cylinders import contest_statistics as contest
from pneumo.evidence.random_cylinders import regimes
from pneumo.evidence.random_cylinders.cylinder_runs import LOOPS, cylinder_cells, random_experiments
from pneumo.evidence.random_cylinders.dimensionless_groups import KNOWN_GROUPS, known_groups
from pneumo.evidence.random_cylinders.direct_rule import direct_rule
from pneumo.evidence.random_cylinders.full_order_contest import RUN_VARIABLES, contest_cells
from pneumo.evidence.seeds.findings import over_seed_sets
from pneumo.evidence.seeds.seed_sets import both_chambers, read_seed_sets, seed_sets, with_seeds
from pneumo.evidence.sensitivity import refinement_variants as variants
from pneumo.evidence.sensitivity.alternatives import grid_alternatives, ledger_alternatives
from pneumo.evidence.sensitivity.toggled_assumptions import toggled_tables
from pneumo.evidence.sensitivity.verdict_power import MISTAKES, Rerun
from pneumo.evidence.signal_sampling.error_budget import observed_order, sliced
from pneumo.evidence.signal_sampling.measured_floor import own_floor
from pneumo.fit.closed.thermal_laws import LAWS, fit_law, read_closed_record
from pneumo.fit.rig import rig_fit, rig_replay
from pneumo.hashing import code_hash, imports_of
from pneumo.papers.paper_2006.numbers_of_tables import TABLES, numbers_of_tables
from pneumo.papers.paper_2006.printed_tables import PAPER_FOLDER, table5
from pneumo.papers.paper_2006.results import ComputedResults
from pneumo.papers.paper_2006.table_likelihood import TableLikelihood, numbers_of_seed_sets
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.signals import EXACT, PUBLISHED
from pneumo.statistics.model_pairs import REFINED_MODELS
from pneumo.storage.files import read, read_json
from pneumo.storage.kept_evidence import KEPT, evidence_file, made
from pneumo.verdict.assumptions import AS_TAKEN
from pneumo.verdict.claims import read_claims

ROOT = KEPT.parents[1]
CONFIGURATION = ROOT / "config" / "paper.yaml"
SHORT = "E13"  # experiment of 15 s


class Sample(NamedTuple):
    """Numbers of a file, and the same computed again."""

    what: str
    kept: np.ndarray
    again: np.ndarray
    tolerance: float  # relative


def _paper() -> Study:
    return study(load(CONFIGURATION))


def _of(file: str, what: str, kept: object, again: object, times: float = 1.0) -> Sample:
    """Sample whose tolerance is `times` that of the digits of its file."""
    return Sample(what, np.asarray(kept), np.asarray(again), times * tolerance(file))


def _shared(
    file: str, what: str, kept: xr.Dataset, again: xr.Dataset, times: float = 1.0
) -> Iterator[Sample]:
    """Samples of the variables that two datasets share."""
    for name in map(str, kept.data_vars):
        if name in again:
            values = again[name].transpose(*kept[name].dims).values
            yield _of(file, f"{what}: {name}", kept[name].values, values, times)


def _seed_sets() -> Iterator[Sample]:
    """One experiment with the seeds of the first set, and all seeds drawn again."""
    file, paper = "seed_sets.nc", _paper()
    kept, drawn = read_seed_sets(KEPT / file), seed_sets(paper, 100)
    for cylinder in ("D", "E"):
        seeds = [drawn[number][cylinder] for number in kept["seeds"].values]
        yield _of(file, f"seeds of {cylinder}", kept[f"seed_{cylinder}"].values.astype(int), seeds)
    number, name = int(kept["seeds"].values[0]), "E16"
    short = paper.with_halvings()
    short = short._replace(experiments={name: short.experiments[name]})
    again = both_chambers(with_seeds(short, drawn[number], threads=1))
    for quantity in ("mse", "mean_error"):
        before = kept[quantity].sel(seeds=number, experiment=[name]).transpose(*again[quantity].dims)
        after = again[quantity].sel(model=kept["model"])
        yield _of(file, f"{name}, set {number}: {quantity}", before, after)


def _findings() -> Iterator[Sample]:
    """Statements judged again over the kept sets of seeds, with exact signals."""
    entries, kept = read_claims(PAPER_FOLDER), json.loads(read_json(KEPT / "findings.json"))["claims"]
    rows = {row["id"]: row for row in kept if row["numbers"]}
    ensemble = read_seed_sets(KEPT / "seed_sets.nc").sel(transport=EXACT).drop_attrs()
    paper, sets = _paper(), ensemble["seeds"].values
    sources = [ComputedResults(paper, EXACT, ensemble.sel(seeds=number)) for number in sets]
    for name in list(rows)[::STATEMENTS]:
        again = over_seed_sets(entries.items[name], entries, sources)._asdict()
        for key, value in rows[name]["numbers"][EXACT].items():
            yield Sample(f"{name}: {key}", np.asarray(value), np.asarray(again[key]), 1e-9)


def _cylinders() -> Iterator[Sample]:
    """One cylinder run again; groups of every `GROUPS`th cylinder; comparisons and rule from kept numbers."""
    file = "cylinders.nc"
    kept = read(KEPT / file)
    lowest = kept["lowest"].sel(cylinder=ANY_CYLINDER)
    again = cylinder_cells(ANY_CYLINDER)["mse"].min("n").sel(model=kept["model"])
    yield _of(file, f"cylinder {ANY_CYLINDER}: lowest", lowest, again.transpose(*lowest.dims))
    known = set(KNOWN_GROUPS) <= set(kept.data_vars)
    groups = _groups(kept["cylinder"].values[:: GROUPS if known else 1])
    if known:
        yield from _shared(file, "groups", kept[list(KNOWN_GROUPS)].sel(cylinder=groups["cylinder"]), groups)
        groups = kept[list(KNOWN_GROUPS)].astype(float)
    runs = groups.merge(kept[["counts", "held_out"]]).assign(lowest=kept["lowest"].astype(float))
    derived = regimes.compare_pairs(runs).merge(regimes.map_of_ratios(runs)).merge(direct_rule(runs))
    derived = derived.merge(regimes.compare_by_thirds(runs, regimes.CONTINUOUS_GROUPS), compat="no_conflicts")
    # Four digits move one run or two of a thousand over a limit or an edge.
    yield from _shared(file, "of all", kept, derived.drop_vars(KNOWN_GROUPS, errors="ignore"), times=5)


def _groups(numbers: np.ndarray) -> xr.Dataset:
    """Dimensionless groups of random cylinders by (cylinder, loop)."""
    both = [random_experiments(int(number)) for number in numbers]
    groups = np.array([[list(known_groups(e).values()) for e in pair] for pair in both])
    values = {name: (("cylinder", "loop"), groups[..., i]) for i, name in enumerate(KNOWN_GROUPS)}
    return xr.Dataset(values, {"cylinder": numbers, "loop": list(LOOPS)})


def _assumptions() -> Iterator[Sample]:
    """One experiment with another gas constant."""
    file, name = "assumptions.nc", "gas_constant.R_287_05"
    alternative = ledger_alternatives(read_yaml(CONFIGURATION))[name]
    alone = {SHORT: alternative.study.experiments[SHORT]}
    alternative = alternative._replace(study=alternative.study._replace(experiments=alone))
    claims = read_claims(PAPER_FOLDER).items.items()
    items = {key: claim for key, claim in claims if f".{SHORT}." in key}
    again = toggled_tables({name: alternative}, items)["reproduced"].sel(alternative=name)
    kept = read(KEPT / file)["reproduced"].sel(alternative=name, item=again["item"])
    yield Sample(f"{SHORT} with {name}", kept.values, again.values, 1e-9)


def _open_loop() -> Iterator[Sample]:
    """One experiment with its setup of lowest score; that score again, from the kept cells."""
    file, paper, name = "open_loop.nc", _paper(), "E15"
    kept = read(KEPT / file)
    first = kept.sel(pair="1")
    pair = [open_loop.SETUPS[number] for number in first["setup_number"].values]
    e = open_loop.with_setup(paper.experiments[name], pair[1])
    recording, draws = record(e), open_loop.draws_of(e)
    on_time = record(open_loop.with_setup(e, pair[1]._replace(late=0.0)))
    number = int(first["setup_number"].sel(cylinder="E"))
    counted = kept["reversals"].sel(open_loop=name).values[number]
    yield _of(file, f"{name}: reversals", int(counted), open_loop.reversals(on_time, draws))
    again = open_loop.joined_cells(paper, e, recording)[:, np.isin(list(MODELS), kept["model"].values)]
    for quantity, values in zip(("mean_error", "mse"), again, strict=True):
        yield _of(file, f"{name}: {quantity}", kept[quantity].sel(experiment=name), values)
    places = tuple(first["setup_number"].values)
    yield _of(file, "lowest score", kept["score"].values[places], kept["score"].min())
    if not of_this_study("seed_sets.nc"):
        return  # its covariance is that of the seed sets
    likelihood = TableLikelihood(numbers_of_seed_sets(paper, read_seed_sets(KEPT / "seed_sets.nc")))
    mean_error, mse = (kept[name].values.astype(float) for name in ("mean_error", "mse"))
    experiments = kept["experiment"].values.tolist()
    numbers = numbers_of_tables(mean_error, mse, paper.n, experiments, paper.experiments_by_level)
    score = likelihood.chi_square(numbers, TABLES) + penalty(pair)
    # From cells of six digits: scores are sums of squares of hundreds of deviations.
    yield Sample("score of the first pair", first["scores"].values[0], np.asarray(score), 1e-3)


def _at_work() -> Iterator[Sample]:
    """Replays of one run; losses from the kept errors."""
    file, paper = "at_work.nc", _paper()
    kept = read(KEPT / file)
    number, loop = 2, 0  # of the plant and the use, from which seeds are drawn
    experiment = paper.experiments[SHORT]
    seeds = np.random.SeedSequence([work.ROOT_SEED, number, loop]).spawn(work.TUNING_SEEDS + work.SEEDS)
    at_plant = kept.isel(plant=number, loop=loop)
    indices = zip(work.CARRIED, at_plant["n"].values.round(2).tolist(), strict=True)
    lanes = [carried.lane(n, experiment.plant.gas.gamma) for carried, n in indices]
    again = np.sqrt(work.replay_errors(work.observer_run(experiment, seeds[work.TUNING_SEEDS]), lanes))
    yield _of(file, f"{SHORT}: replay_error", at_plant["replay_error"].isel(seed=0), again)
    # Correlations are of ranks, which rounded errors exchange here and there.
    yield from _shared(file, "of all", kept[["loss", "cheapest", "hardly_matters"]], at_work_statistics(kept))


def _contest() -> Iterator[Sample]:
    """One cylinder run and replayed again; errors of some choices from the kept runs and rules."""
    file = "contest.nc"
    kept = read(KEPT / file)
    number = int(kept["cylinder"].values[len(kept["cylinder"]) // 2])
    cells = [name for name, about in RUN_VARIABLES.items() if about[1] != "1"]
    again = contest_cells(number)
    yield from _shared(file, f"cylinder {number}", kept[cells].sel(cylinder=number), again)
    direct = read(KEPT / "cylinders.nc")
    fitted = zip(kept["ruled"].values.tolist(), kept["rule_n"].values.tolist(), strict=True)
    rules = {model: (a, b, c) for model, (a, b, c) in fitted}
    below, above = direct["rule_model"].values.tolist()
    made = contest.choices(kept, rules, direct["rule_threshold"].item(), (below, above))
    part, best = contest.runs_counted(kept)["all"], contest.best_in_hindsight(kept)
    for name in ("M6 by rule", "M8 by rule", contest.BEFOREHAND, "full order, adiabatic"):
        ratio: xr.DataArray = contest.at_told(made[name], 1.0, 1.0) / best
        logs = np.log(ratio.transpose(*part.dims).values)
        row = contest.row_of(kept, name)
        assert row is not None
        error = row["error"].sel(part="all")
        yield _of(file, f"error, {name}", error, contest.mean_of_logs(logs, part.values))


def _partly_known() -> Iterator[Sample]:
    """Observers of one plant in one judged run, with the noise that they were tuned to."""
    file, paper = "partly_known.nc", _paper()
    plant, loop, sensors, number = "E13-E14", "open", "one", 2
    kept = read(KEPT / file).sel(plant=plant, loop=loop, sensors=sensors)
    experiment = paper.experiments[plant.partition("-")[0]]
    seed = partly_known.seeds_of(number, 0)[work.TUNING_SEEDS]
    run, signs = work.observer_run(experiment, seed), partly_known.signs_of(seed)
    for scale in kept["scale"].values:
        told = partly_known.Told(run, partly_known.told_plant(experiment.plant, float(scale), signs))
        for row in partly_known.ROWS:
            at = kept.sel(scale=scale, row=row.name)
            model = row.filter_model(at["n"].item(), experiment.plant.gas.gamma)
            noise = at["force_noise"].item(), at["pressure_noise"].item()
            square, _k_0 = partly_known.filter_errors(told, model, sensors, *noise)
            error = at["estimation_error"].isel(seed=0)
            yield _of(file, f"{plant}, {row.name} at {scale:g}", error, square**0.5)


def _fit_coverage() -> Iterator[Sample]:
    """One case fitted again."""
    file, case = "fit_coverage.nc", ANY_CASE
    kept, again = read(KEPT / file).sel(case=case), fit_same_model(FIRST_SEED + case)
    yield from _shared(file, f"case {case}", kept[["truth", "low", "high"]], again)


def _floor() -> Iterator[Sample]:
    """Floor of one experiment's own sampling, measured and predicted."""
    file = "floor.nc"
    kept, again = read(KEPT / file).sel(experiment=SHORT), own_floor(_paper().experiments[SHORT])
    for name, value in zip(("own_measured", "own_predicted"), again, strict=True):
        yield _of(file, f"{SHORT}: {name}", kept[name], value)


def _error_budget() -> Iterator[Sample]:
    """Best n from the kept cells of the study's seeds; totals from their parts; orders from halved steps."""
    file = "error_budget.nc"
    kept = read(KEPT / file)
    every = [name for name, e in _paper().experiments.items() if e.steps <= INSTANTS]
    models = [name for name in kept["model"].values if MODELS[name].has_n]
    mse = read_seed_sets(KEPT / "seed_sets.nc")["mse"].isel(seeds=0, chamber=0).sel(transport=PUBLISHED)
    best = mse.idxmin("n").sel(experiment=every, model=models).transpose("experiment", "model")
    yield _of(file, "best_n", kept["best_n"].sel(experiment=every, model=models), best)
    parts = ("model_error", "transport_error", "discretisation_error", "cross_term")
    total = sum(kept[f"level_{part}"].astype(float) for part in parts)
    yield _of(file, "level_total", kept["level_total"], total)
    yield _of(
        file,
        "order",
        kept["order"].isel(step=slice(None, -1)),
        observed_order(kept["level_halving"].astype(float)),
    )


def _variants() -> Iterator[Sample]:
    """Ratios of one level, with the study as taken."""
    file = "variants.nc"
    kept, alternative = read(KEPT / file)["ratio"], grid_alternatives(read_yaml(CONFIGURATION))[AS_TAKEN]
    levels = alternative.study.experiments_by_level
    level = min(levels, key=lambda name: len(levels[name]))
    runs = [sliced(alternative.study.experiments[name], variants.CUT_TO) for name in levels[level]]
    mse = np.array([variants.refined_errors(e, alternative) for e in runs])[:, None]
    dims = ("experiment", "alternative", "transport", "model", "n")
    along = (levels[level], [AS_TAKEN], variants.BOTH_SAMPLINGS, REFINED_MODELS, alternative.study.n)
    cells = xr.DataArray(mse, {name: list(values) for name, values in zip(dims, along, strict=True)}, dims)
    again = variants.refinement_ratios(cells, {level: levels[level]})["ratio"].sel(level=level)
    before = kept.sel(level=level, alternative=[AS_TAKEN]).transpose(*again.dims)
    yield Sample(f"level {level}", before.values, again.values, 1e-9)


def _identification() -> Iterator[Sample]:
    """The stop of one settling run, searched again."""
    file, name = "identification.nc", "E14"
    kept = read(KEPT / file).sel(stopped=name)
    again = identified_stop(_paper().experiments[name], table5().sel(experiment=name).values)
    for key, value in zip(("", "_low", "_high", "_misfit"), again, strict=True):
        yield _of(file, f"{name}: settling_stop{key}", kept[f"settling_stop{key}"], value)


def _measurements() -> Iterator[Sample]:
    """One law fitted again to one record."""
    file = "measurements.nc"
    kept = read(KEPT / file).isel(record=0, law=0, leakage=0)
    record = read_closed_record(ROOT / "data" / "mbari" / f"{kept['record'].item()}.nc")
    again = fit_law(record, LAWS[kept["law"].item()], leaks=False)
    yield _of(file, "fitted_rms", kept["fitted_rms"], again.rms)
    yield _of(file, "held_out_rms", kept["held_out_rms"], again.held_out)
    values = [again.values.get(name, np.nan) for name in kept["parameter"].values]
    yield _of(file, "value", kept["value"], np.array(values, float))


def _measured_air() -> Iterator[Sample]:
    """Two models fitted again to the vessel, a chamber of the gas spring, and replays of the cylinder."""
    file, data = "measured_air.nc", ROOT / "data"
    kept, rigs = read(KEPT / file), air.records(data)
    vessel, runs = rigs[air.DISCHARGE]
    for model in ("M8", air.FULL_ORDER):
        again, before = rig_fit.judged(vessel, model, runs), kept.sel(case=air.DISCHARGE, model=model)
        for name, value in (
            ("fitted", again.estimate.rms),
            ("held_out", again.held_out),
            ("T_error", again.T),
        ):
            yield _of(file, f"discharge, {model}: {name}", before[name], value)
        kept_values = rig_fit.values_of(before.expand_dims("model"), vessel, model)
        for name in again.estimate.fitted:
            value = np.float64(again.estimate.values[name])
            yield _of(file, f"discharge, {model}: {name}", np.float64(kept_values[name]), value)
    cylinder, pulses = rigs[air.PULSES]
    for model in ("M1", "M6", air.FULL_ORDER):
        before = kept.sel(case=air.PULSES)
        values = rig_fit.values_of(before, cylinder, model)
        left = pulses[len(rig_fit.fitted_runs(pulses)) :]
        P = np.concatenate([rig_replay.run_errors(cylinder, model, values, run)[0] for run in left])
        # From estimates of four digits, a dozen of them.
        yield _of(
            file, f"pulses, {model}: held_out", before["held_out"].sel(model=model), rig_replay.rms(P), 3.0
        )
    record, side = "2022-01-28", 0
    rig, run = air.spring_chamber(data / "mbari", record, side)
    again = rig_fit.judged(rig, air.FULL_ORDER, [run])
    before = kept.sel(record=record, wall=air.LAWS_OF_WALL[0]).isel(chamber=side)
    for name, value in (
        ("spring_fitted", again.estimate.rms),
        ("spring_held_out", again.held_out),
        ("spring_k", again.estimate.values["k_0"]),
    ):
        yield _of(file, f"{record} A: {name}", before[name], value)


def _power() -> Iterator[Sample]:
    """MSE and sigma of Table 7 under mistakes that need no run, from kept cells of the study's seeds.

    Some of these cells were run with halved steps, which changes some numbers of Tables 8 and 9: left out.
    """
    file, paper = "power.nc", _paper()
    kept = read(KEPT / file)["number"]
    cells = read_seed_sets(KEPT / "seed_sets.nc").isel(seeds=0, drop=True).sel(transport=PUBLISHED, drop=True)
    names = [n for n in kept["of"].values if n.startswith("T7.") and not n.endswith(".mu")]
    places = [kept["of"].values.tolist().index(name) for name in names]
    for name, mistake in MISTAKES.items():
        if not isinstance(mistake, Rerun):
            again = ComputedResults(paper, PUBLISHED, mistake(cells.drop_attrs())).numbers[places]
            # Logarithms of four digits and more, from cells of five.
            yield Sample(name, kept.sel(mistake=name, of=names).values, again, 3e-4)


INSTANTS = 20_000  # of a run that the budget looks at: every step of shorter ones
GROUPS = 50  # every fiftieth cylinder's groups are computed again
STATEMENTS = 8  # every eighth statement is judged again
ANY_CYLINDER, ANY_CASE = 1234, 500

SAMPLES: dict[str, Callable[[], Iterator[Sample]]] = {
    "assumptions.nc": _assumptions,
    "at_work.nc": _at_work,
    "contest.nc": _contest,
    "cylinders.nc": _cylinders,
    "error_budget.nc": _error_budget,
    "findings.json": _findings,
    "fit_coverage.nc": _fit_coverage,
    "floor.nc": _floor,
    "identification.nc": _identification,
    "measured_air.nc": _measured_air,
    "measurements.nc": _measurements,
    "open_loop.nc": _open_loop,
    "partly_known.nc": _partly_known,
    "power.nc": _power,
    "seed_sets.nc": _seed_sets,
    "variants.nc": _variants,
}


def of_this_study(file: str) -> bool:
    """Whether a kept file was made from today's configuration of the paper, or needs no configuration."""
    return evidence_file(KEPT, file, _paper().config_sha256) is not None


class Checked(NamedTuple):
    """Outcome of a file's samples."""

    numbers: int
    worst: str  # sample that is farthest off, for its tolerance
    off: float  # its largest relative difference
    good: bool
    by_this_code: bool


SCRIPTS = {"seed_sets.nc": "ensemble_block.py"}  # that compute a file's numbers, where the names differ


def made_by_this_code(file: str) -> bool:
    """Whether a kept file was made by the present code, by the hash of code that it stores."""
    if file == "identification.nc":
        code = code_hash("pneumo.evidence.identification.identify")
    else:
        script = SCRIPTS.get(file, f"{file.partition('.')[0]}.py")
        code = code_hash(*imports_of(ROOT / "workflow" / "scripts" / script))
    return "earlier" not in made(KEPT / file, code)


def check_samples(file: str) -> Checked:
    """Compute the samples of a kept file again and compare them; `ResultError` if the file is damaged."""
    worst, numbers = ("", 0.0, 0.0), 0
    for sample in SAMPLES[file]():
        off = difference(sample.kept, sample.again)
        worst = max(worst, (sample.what, off, off / sample.tolerance), key=lambda known: known[2])
        numbers += sample.kept.size
    what, off, over = worst
    return Checked(numbers, what, off, over <= 1, made_by_this_code(file))
