"""The command as a stranger uses it: from nothing to a page, the record, annotations."""

import json
import subprocess
import sys

import pytest
from test_slips import spoil

from paper_verdict.command import main


def test_from_nothing_to_a_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for command in (
        ["init", "water"],
        ["check", "water", "--record"],
        ["explain", "water", "T1.water.boils"],
    ):
        assert main(command) == 0
    out = capsys.readouterr().out
    assert "4 of 4 agree" in out and "reproduced/table1.csv: boils at liquid=water" in out
    assert main(["page", "water"]) == 0
    assert "T1.ethanol.density" in (tmp_path / "water/verdict.html").read_text(encoding="utf-8")
    assert main(["init", "water"]) == 2 and "already exists" in capsys.readouterr().err


def test_a_skeleton_from_own_tables_asks_for_the_reproduced_numbers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tab_3.csv").write_text("case,value [s]\na,1.25\nb,2.50\n")
    (tmp_path / "other.csv").write_text("row,column,printed,note\nx,mass,3.1,\n")
    assert main(["init", "mine", "tab_3.csv", "other.csv"]) == 0
    assert main(["check", "mine"]) == 2
    err = capsys.readouterr().err
    assert "mine/reproduced/table3.csv:2: value [s]: is empty; write the reproduced number" in err
    spoil(tmp_path / "mine", "reproduced/table3.csv", "a,\nb,\n", "a,1.26\nb,2.5\n")
    spoil(tmp_path / "mine", "reproduced/table2.csv", "x,mass,", "x,mass,3.14")
    assert main(["check", "mine"]) == 0
    out = capsys.readouterr().out
    assert "Table 2  1 of 1 agree" in out and "Table 3  2 of 2 agree" in out
    (tmp_path / "bad.csv").write_text('case,value\na,"1,25"\n')
    assert main(["init", "new", "bad.csv"]) == 2 and not (tmp_path / "new").exists()


def test_exit_code_1_where_something_that_agreed_no_longer_does(toy, capsys):
    assert main(["check", str(toy), "--record"]) == 0
    assert main(["check", str(toy), "--strict"]) == 0
    spoil(toy, "reproduced/table1.csv", "998.2", "980.2")
    capsys.readouterr()
    assert main(["check", str(toy), "--format", "github"]) == 1
    out = capsys.readouterr().out
    assert "LOST  table: was agrees, 4 items, is differs, unexplained" in out
    source = (toy / "published/table1.csv").as_posix()
    assert f"::error file={source},line=2,title=T1.water.density" in out
    assert main(["check", str(toy), "--record"]) == 0
    assert main(["check", str(toy)]) == 0  # recorded as differing
    assert main(["check", str(toy), "--strict"]) == 1
    spoil(toy, "reproduced/table1.csv", "980.2", "998.2")
    assert main(["check", str(toy)]) == 0  # better
    assert main(["check", str(toy), "--strict"]) == 1


def test_a_record_of_statuses_alone_is_enough(toy, capsys):
    (toy / "statuses.csv").write_text('fact,status\ntable,"agrees"\ntext,"agrees"\n')
    assert main(["check", str(toy), "--strict"]) == 0
    spoil(toy, "reproduced/table1.csv", "99.97", "9.997")
    assert main(["check", str(toy)]) == 1


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("table,", "tabel,", "no such fact; did you mean 'table'?"),
        ('"agrees"', '"agree"', "no such status"),
        ("text,", "table,", "is there twice"),
    ],
)
def test_a_wrong_record_is_refused(toy, capsys, old, new, words):
    main(["check", str(toy), "--record"])
    spoil(toy, "statuses.csv", old, new)
    assert main(["check", str(toy)]) == 2
    assert words in capsys.readouterr().err


def test_a_stored_verdict_is_checked_and_shown_without_judging(toy, tmp_path, capsys):
    file = tmp_path / "verdict.json"
    assert main(["check", str(toy), "--json", str(file), "--record"]) == 0
    assert {item["status"] for item in json.loads(file.read_text())["items"]} == {"agrees"}
    (toy / "reproduced/table1.csv").unlink()
    assert main(["check", str(toy), "--verdict", str(file)]) == 0
    assert main(["page", str(toy), "--verdict", str(file), "-o", str(tmp_path / "page.html")]) == 0
    file.write_text("{")
    assert main(["check", str(toy), "--verdict", str(file)]) == 2
    assert "is no verdict" in capsys.readouterr().err


def test_an_unknown_item_is_named_with_the_nearest(toy, capsys):
    assert main(["explain", str(toy), "T1.water.boil"]) == 2
    assert "did you mean 'T1.water.boils'?" in capsys.readouterr().err


def test_pytest_runs_each_fact_as_a_test(toy):
    def run(*arguments):
        command = [sys.executable, "-m", "pytest", "--rootdir", str(toy), "-v", "-rs"]
        command += [f"-pno:{name}" for name in ("cacheprovider", "hypothesispytest", "anyio", "xdist")]
        plugin = [] if _installed() else ["-p", "pytest_paper_verdict"]
        done = subprocess.run(
            [*command, *plugin, "--paper", str(toy), *arguments], cwd=toy, capture_output=True, text=True
        )
        return done.returncode, done.stdout

    code, out = run()
    assert code == 0 and "2 passed" in out
    main(["check", str(toy), "--record"])
    spoil(toy, "reproduced/table1.csv", "998.2", "980.2")
    code, out = run()
    assert code == 1 and "1 failed, 1 passed" in out
    assert "published/table1.csv:2: T1.water.density: printed 998, reproduced 980" in out
    main(["check", str(toy), "--record"])
    code, out = run()
    assert code == 0 and "1 xfailed" in out
    spoil(toy, "claims.yaml", "class: about", "class: abuot")
    code, out = run()
    assert code != 0 and "did you mean 'about'?" in out


def _installed() -> bool:
    from importlib.metadata import entry_points

    return "paper_verdict" in {point.name for point in entry_points(group="pytest11")}
