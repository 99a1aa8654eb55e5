"""The manuscript: no number typed, every number there, the same bytes twice, six to eight pages."""

import json
import re
import shutil

import numpy as np
import pytest
import typst
import xarray as xr
import yaml
from checkout import ROOT
from hypothesis import given
from hypothesis import strategies as st

from pneumo.papers.paper_2006.summary import LEVELS
from pneumo.physics.models import MODELS
from pneumo.publish.text import manuscript as m
from pneumo.publish.text.formatting import with_interval
from pneumo.storage.files import read_json, write, write_json
from pneumo.storage.kept_evidence import KEPT

FOLDER = ROOT / "paper/manuscript"
SOURCE = (FOLDER / "manuscript.typ").read_text(encoding="utf-8")
ABOUT = {"title": "t", "summary": "s", "config_sha256": "c", "code_sha256": "c"}
PAIRS = ("M6/M5", "M8/M7", "M10/M8", "M6/M7")
BOUNDS = [0.8, 0.7, 0.9]


def typed_numbers(source: str) -> list[str]:
    """Numerals that stand typed in the running text of a Typst source.

    Left out are comments, code, mathematics, references, names of models and of standards, equations and
    tables of the paper, and its year.
    """
    text = re.sub(r"//[^\n]*", "", source)
    text = re.sub(r"\$[^$]*\$|`[^`]*`", "", text)
    text = re.sub(r"(?m)^#(let|set|show|import)\b.*(\n[ })\]].*)*", "", text)
    text = re.sub(r"#[a-z_]+(\.[a-zA-Z_0-9]+)*(\.at\(\"[^\"]*\"\)[.\w]*)*", "", text)
    text = re.sub(r"@[\w-]+|<[\w-]+>", "", text)
    text = re.sub(r'"[^"]*"', "", text)
    text = re.sub(r"\bM\d+\b|\bE\d\d?\b|\bISO 6358\b|\b2006\b|\bDOI\b", "", text)
    text = re.sub(r"\b(eqs?|Tables?|Figs?|[Ss]ections?)[ ~]\(?\d+\)?((, | to | and )\(?\d+\)?)*", "", text)
    text = re.sub(r"\b[\d.]+(pt|mm|cm|em|fr|%)", "", text)
    return re.findall(r"\d+(?:\.\d+)?", text)


def test_an_apostrophe_after_a_model_is_no_prime():
    assert not re.search(
        r"\d'", re.sub(r"\$[^$]*\$", "", SOURCE)
    )  # Typst sets a straight one after a digit as a prime


COORDS = {
    **{"experiment": ["E09", "E10"], "transport": ["published", "exact"], "level": ["overall", *LEVELS]},
    **{"model": list(MODELS), "cylinder": ["D", "E"], "parameter": ["M", "k_f", "stop"]},
    **{"averaged": ["mean", "geometric"], "criterion": ["mean", "geometric", "rank"]},
    **{"ratio": list(PAIRS), "pair": list(PAIRS), "loop_of": ["open", "closed", "both"]},
    "alternative": ["inlet.colder", "inlet.warmer", "valve.leak"],
    "statement": [*(f"{pair} < 1" for pair in PAIRS), "M6 enough"],
    **{"group": ["thermal", "exchange"], "third": ["lowest", "middle", "highest"]},
    "bound": ["value", "low", "high"],
}


def full(dims: str, value=BOUNDS) -> xr.DataArray:
    """One value everywhere, or three along the last dimension."""
    coords = {name: COORDS[name] for name in dims.split()}
    return xr.DataArray(np.broadcast_to(value, [len(c) for c in coords.values()]), coords, list(coords))


def invented_ensemble():
    by_level = {"value": 0.8, "low": 0.7, "high": 0.9, "resolvable": 1.05}
    dims = "ratio averaged transport level"
    ensemble = {f"ratio_{name}": full(dims, value) for name, value in by_level.items()}
    ensemble["experiment_ratio_value"] = full("ratio transport experiment", 0.8)
    return xr.Dataset(ensemble).assign(seed_sets=10, failed_sets=("experiment", [0, 1]))


def invented_floor():
    names = {"measured": 400.0, "predicted": 440.0, "formula": 360.0}
    arrays = {name: full("experiment transport", value) for name, value in names.items()}
    floor = xr.Dataset(arrays).expand_dims(period=[1e-4, 1e-3, 1e-2])
    return floor.assign_coords(transport=["linear", "hold"], loop=("experiment", ["open", "closed"]))


def invented_identification():
    values = {"estimate": 1.5, "low": 1.4, "high": 1.6}
    return xr.Dataset({name: full("cylinder parameter", value) for name, value in values.items()})


def invented_budget():
    return xr.Dataset({f"level_{part}_error": full("level model", 4e6) for part in ("model", "transport")})


def invented_variants():
    dims = "transport criterion pair level"
    ratio = full(f"{dims} alternative", 2.6)
    return xr.Dataset({"ratio": ratio, "share": full(dims, 2 / 3), "counted": full(dims, 3)})


def invented_cylinders():
    dims = {"ratio": "loop_of pair criterion bound", "share": "loop_of statement bound"}
    runs = xr.Dataset({n: full(d) for n, d in (dims | {"third_ratio": "group third pair bound"}).items()})
    runs["third_from"] = (("group", "third"), [[1.0, 2.0, 3.0], [0.01, 0.1, 4.34]])
    return runs.assign(counts=(("run", "loop"), [[1, 1], [1, 0], [1, 1]]), held_out=("run", [0, 0, 1]))


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project with the study's verdict, invented evidence and the manuscript's source."""
    root = tmp_path_factory.mktemp("a manuscript")
    results = root / "results"
    (results / "figures").mkdir(parents=True)
    for name in ("parameters.json", "verdict.json"):
        shutil.copy(ROOT / "results" / name, results)
    for name in ("traces", "floor", "ensemble", "regimes"):
        shutil.copy(ROOT / "results/figures/traces.svg", results / f"figures/{name}.svg")
    for name in ("contest.nc", "measured_air.nc", "partly_known.nc"):
        shutil.copy(KEPT / name, results)
    made = {"ensemble": invented_ensemble, "variants": invented_variants, "floor": invented_floor}
    made |= {"identification": invented_identification, "error_budget": invented_budget}
    for name, invented in (made | {"cylinders": invented_cylinders}).items():
        write(invented(), results / f"{name}.nc", ABOUT)
    row = {"claim": "all alike", "published": "1.04", "exact": "5.9", "interval": "5 to 6", "why": ""}
    write_json(json.dumps({"claims": [row | {"stands": "no", "headline": True}]}), results / "findings.json")
    shutil.copytree(FOLDER, root / "paper/manuscript")
    numbers = m.manuscript_numbers(results.glob("*.*")) | {"evidence": ["floor.nc: made in this folder"]}
    (results / "manuscript.json").write_text(json.dumps(numbers), encoding="utf-8")
    return root


@given(st.one_of(st.integers(0, 10**6), st.floats(0.001, 1000).map(lambda x: round(x, 3))))
def test_a_typed_number_is_found(number):
    cut = SOURCE.index(". ", SOURCE.index("= What was reproduced") + 40) + 2
    sentence = f"It has {number} parts, and the conductance $k_0$. "
    if str(number) != "2006":  # the year of the paper is its name
        assert typed_numbers(SOURCE[:cut] + sentence + SOURCE[cut:]) == [str(number)]


def test_no_number_is_typed_metadata_is_complete_and_spans_and_intervals_are_written():
    assert typed_numbers(SOURCE) == []
    none = "M8, E12, Tables 7 and 9, eq (17), ISO 6358 @f2006 $x_2 = 3$ `-j2` #f.a.b // 5\n"
    assert typed_numbers(none) == []
    assert typed_numbers("M8 has 18 % of it, #f.share of 7") == ["18", "7"]
    meta = yaml.safe_load((FOLDER / "metadata.yaml").read_text(encoding="utf-8"))
    assert {"title", "authors", "keywords", "license", "replication"} <= set(meta)
    assert meta["replication"]["doi"] == "10.1243/09596518JSCE203"
    keys = re.findall(r"@\w+\{(\w+),", (FOLDER / "references.bib").read_text(encoding="utf-8"))
    assert len(keys) == len(set(keys))
    assert [key for key in keys if f"@{key}" not in SOURCE] == []
    assert with_interval([0.181, 0.1749, 0.19], 2) == "0.18 (0.17 to 0.19)"
    assert m._span(xr.DataArray([0.9, 1.204])) == {"lowest": "0.90", "highest": "1.20"}
    floor = m._floor(invented_floor())
    assert floor["theory"] == {"lowest": "1.10", "highest": "1.10"}
    assert floor["formula_open"] == {"lowest": "0.90", "highest": "0.90"}
    assert (floor["shortest"], floor["longest"], floor["highest"]) == ("0.1 ms", "10 ms", "400 Pa")
    variants = m._variants(invented_variants())
    assert variants["rows"][0] == {"pair": "M6/M5"} | dict.fromkeys(LEVELS, "2 of 3")
    assert variants["inlet"]["highest"] == "2.6"
    cylinders = m._cylinders(invented_cylinders())
    assert cylinders["enough"] == "80 % (70 % to 90 %)" and cylinders["exchange"]["much"] == "4.3"
    assert (cylinders["compared"], cylinders["within"], cylinders["failed"]) == ("2", "10 %", "1")
    assert m._budget(invented_budget())["typical"]["M8"] == {"model": "2.00 kPa", "transport": "2.00 kPa"}


@pytest.mark.results
def test_numbers_are_those_of_the_results(project):
    quoted = json.loads((project / "results/manuscript.json").read_text(encoding="utf-8"))
    verdict = json.loads(read_json(ROOT / "results/verdict.json"))
    assert quoted["verdict"]["counts"]["missed"] == str(verdict["counts"]["missed"])
    assert quoted["setup"]["replays"] == "1056"
    assert quoted["verdict"]["claimed"]["of_M6"] == "40 %"
    rows = {(row["level"], row["source"]): row for row in quoted["verdict"]["transport"]}
    assert quoted["verdict"]["exact"]["typical"] == f"{100 * float(rows['typical', 'exact']['M8/M7']):.0f} %"


@pytest.mark.results
def test_it_is_typeset_twice_to_the_same_bytes_on_six_to_eight_pages(project):
    source, one, two = project / "paper/manuscript/manuscript.typ", project / "one.pdf", project / "two.pdf"
    for output in (one, two):
        m.compile_pdf(source, project, output)
    assert one.read_bytes() == two.read_bytes()
    assert one.read_bytes()[:5] == b"%PDF-" and str(project).encode() not in one.read_bytes()
    pages = typst.compile(str(source), root=str(project), format="png", ppi=20, ignore_system_fonts=True)
    assert isinstance(pages, list) and 6 <= len(pages) <= 8


@pytest.mark.results
def test_a_number_that_is_not_there_is_an_error(project):
    source = project / "paper/manuscript/wrong.typ"
    source.write_text(SOURCE + "\n#f.verdict.counts.nonsense\n", encoding="utf-8")
    with pytest.raises(typst.TypstError, match="nonsense"):
        m.compile_pdf(source, project, project / "wrong.pdf")
    assert not (project / "wrong.pdf").exists()
