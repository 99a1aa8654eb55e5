"""The documentation: every block of code runs, every number is the results', every public name is there."""

import json
import re
import shlex
import shutil
import subprocess
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import nbformat
import numpy as np
import pytest
import xarray as xr
from browser import Tab
from checkout import ROOT
from markdown_it import MarkdownIt
from markdown_it.token import Token
from page_checks import assert_accessible, assert_readable, in_chromium
from typer.testing import CliRunner

import pneumo
from pneumo.cli import commands as cli
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.storage.kept_evidence import KEPT
from pneumo.verdict.errata import read_errata

DOCS, SITE = ROOT / "docs", ROOT / "site"
PAGES = sorted(DOCS.glob("*.md"))
# Pages of the site without a source of their own in docs; decisions are alike, so one of them.
GENERATED = ("search", "genindex", "py-modindex", "decisions/0155-how-a-fit-is-judged")

# What an example of a shell says but no test runs, by its first words, and why.
NOT_RUN = {
    "git clone": "needs the network",
    "cd": "follows the clone",
    ". .venv/bin/activate": "is how the tests are run",
    "uv pip install": "needs the network",
    "snakemake --profile": "needs Slurm; `make slurm-test` runs it",
    "pneumo study --from": "needs the results of a fleet; a test of the workflow runs it",
    "python -m benchmarks.fmu_runs": "takes hours; tests of the papers run parts of it",
    "python tests/independent_simulator.py": "takes hours; tests of the papers run parts of it",
    "pneumo paper verdict --runs": "needs another simulator's runs; tests of the papers make some",
}
UNKNOWN = "pneumo paper explain T7.M11.mse"
INCLUDE = re.compile(r"^```\{include\} (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module", autouse=True)
def modules_of_the_docs():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Folder with results, as an example finds it; one after the other they fill it."""
    from small_study import small_study

    folder = tmp_path_factory.mktemp("docs")
    small_study(folder / "results", folder / "small.yaml")
    for name in ("config", "data", "paper", "pneumo"):
        (folder / name).symlink_to(ROOT / name)
    return folder


def included(match: re.Match[str]) -> str:
    """What an {include} puts in its place."""
    text = (DOCS / match.group(1)).read_text(encoding="utf-8")
    for option, mark in re.findall(r'^:([\w-]+): "(.*)"$', match.group(2), re.MULTILINE):
        before, found_mark, after = text.partition(mark.replace("\\n", "\n"))
        assert found_mark, f"{match.group(1)} has no {mark!r}"
        text = after if option == "start-after" else before
    return text


def blocks(page: Path) -> list[Token]:
    """Blocks of code of a page and of what it includes; MyST's other directives are none."""
    tokens = MarkdownIt().parse(INCLUDE.sub(included, page.read_text(encoding="utf-8")))
    return [token for token in tokens if token.type == "fence" and not token.info.startswith("{")]


@cache
def rules() -> set[str]:
    """Names of the workflow's rules."""
    files = [ROOT / "Snakefile", *(ROOT / "workflow/rules").glob("*.smk")]
    return {name for file in files for name in re.findall(r"^rule (\w+):", file.read_text(), re.MULTILINE)}


def run_line(line: str, folder: Path) -> None:
    """Run a line of a shell, or see that it could be."""
    words = shlex.split(line, comments=True)
    if any(line.startswith(start) for start in NOT_RUN):
        return
    if words[0] == "make":
        assert all(f"\n{target}:" in (ROOT / "Makefile").read_text() for target in words[1:]), line
    elif words[0] == "snakemake":
        from snakemake.cli import parse_args  # half a second, which no other test needs

        _, given = parse_args(words[1:])  # ends with SystemExit where it does not know an option
        assert set(given.targets) <= rules(), line
        assert all((folder / file).is_file() for file in given.configfile or []), line
    elif words[0] == "pneumo":
        done = CliRunner().invoke(cli.app, words[1:])
        assert done.exit_code == 0, f"{line}: {done.output} {done.exception}"
    elif words[0] in ("cc", "./m8_test"):
        subprocess.run(words, cwd=folder, check=True)
    else:
        pytest.fail(f"{line}: no test runs this; run it, or say in NOT_RUN why not")


def run_block(block: Token, page: Path, folder: Path, names: dict) -> None:
    """Run one block; Python sees what the blocks above it on the page have defined."""
    if block.info == "python":
        exec(compile(block.content, page.name, "exec"), names)  # noqa: S102 - the project's own pages
    elif block.info == "sh":
        for line in filter(None, block.content.splitlines()):
            run_line(line, folder)
    elif block.info == "yaml":
        name = re.match(r"# ([\w-]+\.yaml)\n", block.content)
        assert name, f"{page.name}: an example of a configuration begins with its file's name"
        (folder / name.group(1)).write_text(block.content)
    else:
        pytest.fail(f"{page.name}: nothing runs blocks of {block.info!r}")


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=lambda page: page.stem)
@pytest.mark.xdist_group("docs")
def test_code_runs(page, folder, monkeypatch):
    monkeypatch.chdir(folder)
    names: dict = {"__name__": "__main__"}
    for block in blocks(page):
        run_block(block, page, folder, names)


@pytest.mark.slow
@pytest.mark.xdist_group("docs")
@pytest.mark.parametrize("line", [UNKNOWN, "make reproduction", "snakemake -j2 proofs", "rm -r x", "cc no.c"])
def test_a_wrong_line_is_noticed(line, folder, monkeypatch):
    monkeypatch.chdir(folder)
    with pytest.raises((AssertionError, pytest.fail.Exception, subprocess.CalledProcessError)):
        run_line(line, folder)


def run_notebook(page, folder, monkeypatch):
    """Run the cells of a page that is a notebook in a folder; return the names that they define."""
    monkeypatch.chdir(folder)
    (folder / "config").symlink_to(ROOT / "config")
    names: dict = {}
    for token in MarkdownIt().parse((DOCS / f"{page}.md").read_text(encoding="utf-8")):
        code = re.sub(r"^:.*\n", "", token.content)
        if token.info == "{code-cell}" and code.startswith("%%sh"):
            for line in code.splitlines()[1:]:
                run_line(line, folder)
        elif token.info == "{code-cell}":
            exec(compile(code, f"{page}.md", "exec"), names)  # noqa: S102 - the project's own page
    names["plt"].close("all")
    return names


@pytest.mark.slow
def test_an_exported_model_in_mujoco_follows_the_full_order(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    names = run_notebook("mujoco", tmp_path, monkeypatch)
    rms, size = names["rms"], names["F"].std()
    assert rms["M8"] < 0.02 * size < 0.1 * size < rms["MuJoCo's cylinder"]


@pytest.mark.slow
def test_the_controllers_fmu_positions_the_plants(tmp_path, monkeypatch):
    pytest.importorskip("fmpy")
    for name in ("controller.c", "controller.xml", "system.ssd"):
        shutil.copy(DOCS / name, tmp_path)
    names = run_notebook("co-simulation", tmp_path, monkeypatch)
    run = names["run"]
    assert names["problems"] == {"plant.fmu": [], "controller.fmu": []}
    # The command is the controller's law on the position of the last communication point.
    np.testing.assert_array_equal(run["controller.u"][1:], 100 * (run["reference"] - run["plant.x"])[:-1])
    np.testing.assert_array_equal(run["plant.u"][1:], run["controller.u"][1:])  # after the exchange
    assert abs(run["plant.x"][999] - 0.02) < 1e-4 and abs(run["plant.x"][1999] + 0.02) < 1e-4
    assert names["off"]["x"] < 1e-12 and names["off"]["P_A"] < 1e-3 and names["off"]["P_B"] < 1e-3


def assert_current(numbers):
    from fragments import stored_numbers

    stored = stored_numbers()
    assert {page: stored[page] for page in numbers} == numbers, "run: make numbers"


def test_numbers_are_those_of_the_kept_evidence():
    from page_numbers import from_kept_files

    assert_current(from_kept_files())


@pytest.mark.results
def test_numbers_are_those_of_the_study(results):
    from page_numbers import from_the_study

    assert_current(from_the_study(results))


def test_every_number_is_on_a_page_and_every_name_on_a_page_has_a_number():
    from fragments import stored_numbers

    made = {(page, name) for page, numbers in stored_numbers().items() for name in numbers}
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    on_pages = set(re.findall(r"\{\{ (\w+)\.(\w+) \}\}", text))
    assert {name for name in on_pages if name[0] not in ("errata", "blocks")} <= made
    text_of_readme = (DOCS / "readme_blocks.py").read_text(encoding="utf-8")
    assert [name for name in made - on_pages if f'"{name[1]}"' not in text_of_readme] == []
    assert "<!--" not in text


def test_every_block_is_on_a_page_and_no_other():
    from readme_blocks import OF_PAGES

    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert set(re.findall(r"\{\{ blocks\.(\w+) \}\}", text)) == {make.__name__ for make in OF_PAGES}


def test_pictures_of_pages_are_of_one_width():
    # Made by tests/readme_pictures.py; their bytes are a browser's.
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    for name in ("report", "live"):
        picture = (ROOT / f"paper/readme/{name}.png").read_bytes()
        assert picture[1:4] == b"PNG" and int.from_bytes(picture[16:20], "big") == 1200
        assert len(picture) < 300_000
        assert f"(../paper/readme/{name}.png)" in text


def test_the_scheme_of_a_rig_shows_every_volume_and_restriction():
    from rig_scheme import DESCRIPTION, rig_scheme

    from pneumo.fit.rig.rig_file import OF_B, QUANTITIES

    drawing = ElementTree.fromstring(re.search("<svg.*</svg>", rig_scheme(), re.DOTALL)[0])
    texts = {text.text for text in drawing.iter("text")}
    parts = {name for name in QUANTITIES if re.search("volume$|_C|_b|^k_0|^store|bore|orifice", name)} - {
        *OF_B
    }
    assert parts <= texts and {"silencer_C", "hose_volume", "k_0"} <= parts
    assert drawing.find("desc").text == DESCRIPTION and drawing.get("role") == "img"


def test_sentences_of_measurements_hold():
    from measurements import SIMPLE, WALL

    held = xr.load_dataset(KEPT / "measurements.nc")["held_out_rms"]
    none = (held.sel(leakage="none") ** 2).mean("chamber") ** 0.5
    # Wall heat in every record.
    assert (none.sel(law=SIMPLE).min("law") > none.sel(law=WALL).max("law")).all()
    assert (none.sel(law=SIMPLE, record="2022-01-28") > 3 * none.sel(law=WALL[0], record="2022-01-28")).all()
    area = none.sel(law="wall heat, area and root of PT")
    assert ((area > none.sel(law=WALL).max("law")).sum("record") == 2).all()
    leaky = (held.sel(leakage="past the piston", law=WALL) ** 2).mean("chamber") ** 0.5
    assert np.abs(leaky - none.sel(law=WALL)).max() < 3e3  # Pa
    simple = (held.sel(leakage="past the piston", law=SIMPLE) ** 2).mean("chamber") ** 0.5
    assert (simple > none.sel(law=SIMPLE)).all()


def test_sentences_of_the_bench_of_fits_hold():
    bench = json.loads((ROOT / "docs/static/fit_bench.json").read_text(encoding="utf-8"))
    none, rows = bench["table"]["none"], bench["table"].values()
    assert bench["undisturbed"]["k_0"]["error"] < 0.1 < bench["unwarned"]["k_0"]["error"]
    share = {name: row["held"] / row["intervals"] for name, row in bench["undisturbed"].items()}
    assert 0.93 <= share.pop("C") <= 0.97 < min(share.values())
    assert none["warned"] > 0.05 * none["records"] and none["cause wrong"] > 0
    assert sum(row["silent"] for row in rows) > 0


def test_sentences_of_measured_air_hold():
    from measured_air import CONSTANT_T, EQ_7, FULL, LAWS_OF_WALL, SPRING_STORE

    air = xr.load_dataset(KEPT / "measured_air.nc")
    pulses, bare = (air["held_out"].sel(case=case) for case in ("pulses", "pulses, no hose"))
    assert pulses.idxmin().item().startswith("full order") and pulses.sel(model=FULL) < 2.5e3  # Pa
    assert bare.min() > 2.5 * pulses.max() and pulses.sel(model="M1") > 1.3 * pulses.sel(model="M8")
    assert bare.min() - pulses.max() > np.ptp(pulses.values)  # the hose costs more than all models differ
    wall = air.sel(case="pulses", model=FULL, parameter="k_0_W_per_K")
    assert wall["low"] < 0  # not determined
    fitted = air["fitted"].sel(case="discharge")
    assert fitted.sel(model=FULL) < 2.5e3
    assert (
        fitted.sel(model=FULL)
        < fitted.sel(model="M8")
        < fitted.sel(model="M6")
        < fitted.sel(model=CONSTANT_T).min()
    )
    for with_mixing, without in (("M6", "M5"), ("M8", "M7")):  # no air enters
        assert fitted.sel(model=with_mixing).item() == pytest.approx(
            fitted.sel(model=without).item(), rel=1e-3
        )
    assert air["fitted"].sel(case="discharge, free", model="M5") < fitted.sel(model=FULL)
    assert air["T_error"].sel(case="discharge", model="M8") > 4 * air["T_error"].sel(
        case="discharge", model=FULL
    )
    across, back = (air["other_P"].sel(case=case) for case in ("discharge", "filling"))
    assert across.sel(model=FULL) < 2.5e3 < across.sel(model=["M5", "M6", "M7", "M8"]).min()
    assert back.sel(model=FULL) < 0.5 * back.drop_sel(model=FULL).min()
    spring = air["spring_held_out"].sel(chamber="A")
    constant, eq_7, store = (spring.sel(wall=law) for law in LAWS_OF_WALL[:3])
    assert (store < 0.65 * constant).all() and store.sel(record="friction") < 10.5e3
    assert (eq_7 > 0.85 * constant).all()
    # A skin of the wall is the same response as a store: its search may end lower, not higher.
    skin = air["spring_held_out"].sel(wall=LAWS_OF_WALL[3])
    assert (skin < 1.01 * air["spring_held_out"].sel(wall=LAWS_OF_WALL[2])).all()
    fitted_store, fitted_skin = (air["spring_fitted"].sel(wall=LAWS_OF_WALL[i]) for i in (2, 3))
    on_bound = air["spring_c"].sel(wall=LAWS_OF_WALL[2]) >= SPRING_STORE[1]
    assert on_bound.values.tolist() == [[False, True], [False, False], [False, False]]
    assert (abs(fitted_store / fitted_skin - 1) < 1e-3).values[~on_bound.values].all()
    nitrogen, T = air["fitted"].sel(case="nitrogen"), air["T_error"].sel(case="nitrogen")
    order = [nitrogen.sel(model=name).item() for name in (FULL, "M8", "M6")]
    assert order == sorted(order) and order[-1] < nitrogen.sel(model=CONSTANT_T).min()
    assert nitrogen.sel(model=FULL) < nitrogen.sel(model=EQ_7) < 1.15 * nitrogen.sel(model=FULL)
    assert T.sel(model=EQ_7) < 0.75 * T.sel(model=FULL)


def test_sentences_of_at_work_hold():
    from at_work import CONTROLLERS, OBSERVERS, WITHOUT_WALL

    at_work = xr.load_dataset(KEPT / "at_work.nc")
    right = at_work.sel(factor=1.0)
    assert at_work.sizes["plant"] == 7
    # M8 and M10 are nearest the best on average, and replays rank observers.
    lost = np.log(right["loss"].sel(use=OBSERVERS, bound="estimate")).mean(("use", "plant"))
    assert lost["compared"].values[np.argsort(lost.values)[:2]].tolist() == ["M10", "M8"]
    correlation = right["mean_correlation"]
    assert (correlation.sel(use=OBSERVERS, bound="low") > 0.5).all()
    # The one exception, and what the two put first there.
    low = right["correlation"].sel(use=OBSERVERS, bound="low")
    not_predicted = low.stack(case=("use", "plant")).where(lambda bound: bound <= 0, drop=True)
    assert set(not_predicted["case"].values) == {(use, "D, 2.5 W/K") for use in OBSERVERS if "open" in use}
    d = right.sel(plant="D, 2.5 W/K")
    replays = d["replay_error"].sel(loop="open").mean("seed")
    assert set(replays["model"].values[np.argsort(replays.values)[:2]]) == {"M5", "M6"}
    loss = d["loss"].sel(use=[use for use in OBSERVERS if "open" in use], bound="estimate")
    assert not set(loss["compared"].values[loss.argmin("compared")]) & set(WITHOUT_WALL)
    # No model matters little to an observer; of those without wall heat M6 alone is ever enough.
    assert not right["hardly_matters"].sel(use=OBSERVERS).any()
    enough = right["loss"].sel(use=OBSERVERS, compared=WITHOUT_WALL, bound="high") < 1.1
    assert set(enough["compared"].values[enough.any(("use", "plant"))]) == {"M6"}
    errors = np.log(at_work["estimation_error"]).mean(("plant", "seed"))
    wrong = errors.sel(carried=["M8, 0.5 k_0", "M8, 2 k_0"]).max("carried")
    assert (wrong < errors.sel(carried=WITHOUT_WALL).min("carried")).all()
    # Controllers.
    hardly = right["hardly_matters"].sel(use=CONTROLLERS) == 1
    assert hardly.drop_sel(use="controller, following, none").all()
    for use in CONTROLLERS:
        assert correlation.sel(use=use, bound="low") < 0.5
    assert correlation.sel(use="controller, following, none", bound="high") < 0


def test_sentences_about_random_cylinders_hold():
    runs = xr.load_dataset(KEPT / "cylinders.nc")
    ratio = runs["third_ratio"].sel(group="exchange", pair="M8/M7")
    assert ratio.sel(third="highest", bound="high") < 0.67
    others = ratio.sel(third=["lowest", "middle"])
    assert ((others > 0.9) & (others < 1.15)).all()


@pytest.mark.results
def test_sentences_of_which_model_hold(results):
    from which_model import by_experiment, over_levels

    both = over_levels(results)["mse"]
    exact = both.sel(transport="exact")
    little, much = exact.sel(level="adiabatic"), exact.sel(level="isothermal")
    cells = by_experiment(results).sel(transport="exact")
    open_D = cells.sel(experiment=["E01", "E05"])

    def gain(at, new, old):
        return at.sel(model=new) / at.sel(model=old)

    assert gain(little, "M6", "M5") < 0.5 < 0.75 < gain(little, "M7", "M5")  # mixing pays, wall heat hardly
    assert gain(much, "M7", "M5") < 0.75 < 0.9 < gain(much, "M6", "M5")  # the other way round
    assert gain(little, "M6", "M7") < 1 < gain(much, "M6", "M7")
    assert (gain(both, "M6", "M5") < 1).all()
    mixing = gain(cells, "M8", "M7")
    assert set(mixing["experiment"].values[mixing.argsort()[:2]]) == {"E04", "E08"}  # closed loop of E
    assert (gain(open_D, "M8", "M7") > 1).all()
    open_loop = cells.where(cells["loop"] == "open", drop=True)
    assert (gain(open_loop, "M5", "M6") < 1).sum() > len(open_loop["experiment"]) / 2
    for level in ("adiabatic", "typical"):
        at = both.sel(level=level)
        assert gain(at.sel(transport="published"), "M8", "M7") > gain(at.sel(transport="exact"), "M8", "M7")


def test_architecture_lists_the_rooms_in_the_order_of_the_import_contract():
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    table = page.partition("| room |")[2].partition("\n\n")[0]
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(c["layers"] for c in contracts["contracts"] if c["type"] == "layers")
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == layers[::-1]
    for name in ("docs/architecture.md", "CONTRIBUTING.md", "pyproject.toml"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert re.findall(r"imports only from rooms (\w+)", text, re.IGNORECASE) == ["above"], name
    inside = [path for path in (ROOT / "pneumo").iterdir() if path.suffix in ("", ".py")]
    assert set(layers) == {path.stem for path in inside if not path.name.startswith("__")}


def test_no_two_modules_share_a_name():
    modules = [file for file in (ROOT / "pneumo").rglob("*.py") if file.stem != "__init__"]
    # Both papers' folders use the same names for the same roles.
    of_papers = {file.stem for file in modules if file.parent.parent.name == "papers"}
    others = [file.stem for file in modules if file.parent.parent.name != "papers"]
    assert [name for name, count in Counter([*of_papers, *others]).items() if count > 1] == []


def test_theory_has_every_erratum_once_and_the_papers_numbers_of_equations():
    named = re.findall(r"\{\{ errata\.(\w+) \}\}", (DOCS / "theory.md").read_text(encoding="utf-8"))
    assert sorted(named) == sorted(read_errata(PAPER_2006.folder, PAPER_2006.proofs))
    # Sphinx counts equations in their order: they carry the paper's numbers.
    labels = re.findall(r"^\$\$ \((\w+)\)$", (DOCS / "theory.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert labels == [f"eq{number}" for number in range(1, 18)]


@pytest.mark.parametrize("name", pneumo.__all__)
def test_public_name_is_in_the_api(name):
    assert re.search(rf":: pneumo\.{name}$", (DOCS / "api.md").read_text(encoding="utf-8"), re.MULTILINE)


def test_models_and_commands_are_the_programs():
    from fragments import commands, models

    table = models()
    assert "| M4 | 1.2 | 1.4 | 1.0 | constant | no | none |" in table
    assert r"| M10 | $\gamma$ | $\gamma$ | $\gamma$ | polytropic | yes | $\lambda(P, T) A_q(x)$ |" in table
    text = commands()
    for group, name in ((cli.app, "pneumo"), (cli.paper, "pneumo paper")):
        for command in group.registered_commands:
            title = command.name or command.callback.__name__.replace("_", "-")
            assert f"## `{name} {title}`" in text


@pytest.mark.parametrize(
    "page", [page for page in PAGES if "file_format: mystnb" in page.read_text()], ids=str
)
def test_a_notebook_has_the_pages_cells_in_plain_markdown(page):
    from fragments import stored_numbers
    from notebooks import as_notebook, kind_of_results, pages, with_link

    assert page.stem in pages()
    notebook = as_notebook(page.stem, stored_numbers() | {"results": kind_of_results()})
    nbformat.validate(notebook)
    text = page.read_text(encoding="utf-8")
    cells = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    assert len(cells) == len(re.findall(r"^```\{(?:code-cell|literalinclude)\}", text, re.MULTILINE))
    said = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    assert re.findall(r"\{[\w:]+\}`|\{\{|```\{|^:\w+:", said, re.MULTILINE) == []
    assert said.startswith("# ") and with_link(page.stem, text).count(f"notebooks/{page.stem}.ipynb") == 1


def test_a_notebook_brings_the_files_that_its_page_shows():
    from notebooks import as_notebook

    shown = [cell.source for cell in as_notebook("bench", {}).cells if "writefile replay.c" in cell.source]
    assert shown == [f"%%writefile replay.c\n{(DOCS / 'replay.c').read_text()}".rstrip("\n")]


def test_the_index_has_every_page_once_by_kind():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    trees = dict(re.findall(r"^:caption: (.*)\n:titlesonly:\n\n((?:[\w-]+\n)+)```", index, re.MULTILINE))
    assert list(trees) == ["Tutorials", "How-to", "Findings", "Explanation", "Reference"]
    listed = " ".join(trees.values()).split()
    assert sorted(listed) == sorted(page.stem for page in PAGES if page.stem != "index")


no_site = pytest.mark.skipif(not (SITE / "index.html").exists(), reason="no site/: `make docs` builds it")
in_site = [no_site, in_chromium, pytest.mark.xdist_group("chromium")]


@pytest.fixture
def browser(chromium):
    """A telephone: Chromium's own window is never narrower than 500 pixels."""
    telephone = Tab(chromium, width=390, height=800, is_mobile=True)
    yield telephone
    telephone.context.close()


class TestSite:
    pytestmark = in_site

    @pytest.mark.slow
    def test_pages_need_no_network_fit_a_narrow_screen_and_have_contrast(self, browser):
        pages = sorted(SITE.rglob("*.html"))
        assert len(pages) > len(PAGES)
        for page in pages:
            browser.open(page)
            width = browser.run("document.documentElement.scrollWidth")
            assert width <= 390, f"{page.name}: {width} px wide"
            for scheme in ("light", "dark"):
                browser.page.emulate_media(color_scheme=scheme)
                assert_readable(browser, least=10)
        assert [url for url in browser.requests if not url.startswith(("file:", "data:"))] == []
        assert browser.console == []

    def test_formulas_are_drawn(self, browser):
        browser.open(SITE / "theory.html")
        assert browser.run("document.querySelectorAll('.formula .eqno').length") == 17
        heights = "[...document.querySelectorAll('math')].map(m => m.getBoundingClientRect().height)"
        assert min(browser.run(heights)) > 5

    def test_search_finds_pages_and_no_decisions(self, browser):
        browser.open(SITE / "search.html", "?q=polytropic")
        script = """new Promise(done => {
            const found = () => [...document.querySelectorAll('#search-results li a')].map((a) => a.href);
            const look = () => found().length ? done(found()) : setTimeout(look, 50);
            look(); setTimeout(() => done([]), 30000); })"""
        result = browser.run(script)
        assert result and not any("/decisions/" in address for address in result)

    def test_code_has_buttons_that_copy(self, browser):
        browser.open(SITE / "start.html")
        browser.wait("document.querySelectorAll('button.copybtn').length > 2")

    def test_links_to_notebooks_lead_to_notebooks(self):
        from notebooks import pages

        for page in pages():
            assert f'href="notebooks/{page}.ipynb" download' in (SITE / f"{page}.html").read_text("utf-8")
            nbformat.read(SITE / f"notebooks/{page}.ipynb", as_version=4)

    @pytest.mark.slow
    @pytest.mark.parametrize("page", [*(page.stem for page in PAGES), *GENERATED])
    def test_pages_are_accessible(self, page, chromium):
        tabs = []

        def visit(file, **options):
            tabs.append(Tab(chromium, **options))
            tabs[-1].open(file)
            return tabs[-1]

        assert_accessible(visit, SITE / f"{page}.html")
        for tab in tabs:
            tab.context.close()


def test_only_the_answer_made_from_the_evidence_says_which_model_to_take():
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "paper/joss").glob("*.md")]
    told = {
        page.name: re.findall(r"(?i)\b(?:take|use|choose|recommend\w*) \**M\d+", page.read_text())
        for page in pages
    }
    assert {name: words for name, words in told.items() if words} == {}
