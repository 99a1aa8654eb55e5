"""The documentation: every block of code runs, every number is the results', every public name is there."""

import re
import shlex
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import pytest
from checkout import ROOT
from markdown_it import MarkdownIt
from markdown_it.token import Token
from typer.testing import CliRunner
from workflow_scripts import script

import pneumo
from paper.study.samplings import STUDY_SAMPLINGS
from paper_verdict.command import main as judge
from pneumo.cli import commands as cli
from pneumo.configuration.parameters import load, study
from workflow.jobs.checksums import write_sums

DOCS, SITE = ROOT / "docs", ROOT / "site"
PAGES = sorted(DOCS.glob("*.md"))

# What an example of a shell says but no test runs, by its first words, and why.
NOT_RUN = {
    "git clone": "needs the network",
    "cd": "follows the clone",
    ". .venv/bin/activate": "is how the tests are run",
    "uv pip install": "needs the network",
    "snakemake --profile": "needs Slurm",
    "pip install ./paper-verdict": "it is installed",
    "pneumo paper verdict --runs": "needs another simulator's runs; tests of the papers make some",
}
INCLUDE = re.compile(r"^```\{include\} (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module", autouse=True)
def modules_of_the_docs():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Folder with the results of a study of a second, as an example finds it; the examples fill it."""
    folder = tmp_path_factory.mktemp("docs")
    results, override, names = folder / "results", folder / "small.yaml", ("E06", "E12")
    override.write_text(f"name: small\nrun: {{experiments: [{', '.join(names)}], duration_limit_s: 1.0}}\n")
    parameters, small = results / "parameters.json", study(load(ROOT / "config/paper.yaml", override))

    def each(part: str) -> list[Path]:
        return [results / part / f"{name}.nc" for name in names]

    script("settling")(small, each("settling"), results / "settling.nc")
    script("datum")(small, parameters, each("datum"), 1)
    replays = [file for sampling in STUDY_SAMPLINGS for file in each(f"{sampling}/replay")]
    script("replay")(parameters, each("datum"), replays, 2)
    script("statistics")(parameters, [results / sampling / "statistics.nc" for sampling in STUDY_SAMPLINGS])
    script("simulated_example")(results / "2007/example.nc")
    verdict = results / "verdict.json"
    script("verdict")("2006", ROOT / "paper/2006/claims.yaml", {}, verdict, verdict.with_suffix(".html"))
    write_sums(results)
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
    elif words[0] == "paper-verdict":
        assert judge(words[1:]) == 0, line
    elif words[0] in ("cc", "./full_test"):
        subprocess.run(words, cwd=folder, check=True)
    else:
        pytest.fail(f"{line}: no test runs this; run it, or say in NOT_RUN why not")


def run_block(block: Token, page: Path, folder: Path, names: dict) -> None:
    """Run one block; Python sees what the blocks above it on the page have defined."""
    if block.info == "python":
        # In angle brackets: Hypothesis would look for the code in a file of that name.
        exec(compile(block.content, f"<{page.name}>", "exec"), names)  # noqa: S102 - the project's own pages
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


def assert_current(numbers):
    from fragments import stored_numbers

    stored = stored_numbers()
    assert {page: stored[page] for page in numbers} == numbers, "run: make numbers"


def test_the_table_of_keys_is_that_of_the_schema():
    from configuration_keys import KEYS, keys

    assert KEYS.read_text(encoding="utf-8") == keys(), "run: make numbers"


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
    made -= {("study", "answer"), ("look", "output")}  # of README
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    on_pages = set(re.findall(r"\{\{ (\w+)\.(\w+) \}\}", text))
    assert {name for name in on_pages if name[0] != "errata"} == made
    assert "<!--" not in text


def test_architecture_lists_the_rooms_in_the_order_of_the_import_contract():
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    table = page.partition("| room |")[2].partition("\n\n")[0]
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(c["layers"] for c in contracts["contracts"] if c["type"] == "layers")
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == layers[::-1]
    inside = [path for path in (ROOT / "pneumo").iterdir() if path.suffix in ("", ".py")]
    assert set(layers) == {path.stem for path in inside if not path.name.startswith("__")}


@pytest.mark.parametrize("name", pneumo.__all__)
def test_public_name_is_in_the_api(name):
    assert re.search(rf":: pneumo\.{name}$", (DOCS / "api.md").read_text(encoding="utf-8"), re.MULTILINE)
