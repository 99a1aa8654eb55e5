"""Errors planted in the examples: a wrong computation never convicts, a wrong print only by a proof."""

import pytest
from small_papers import EXAMPLES

from paper_verdict import Judge, load_paper
from paper_verdict.facts import AGREES, MISPRINT, SCATTER, UNEXPLAINED

# Paper, item, file, text and what takes its place. A print is mistranscribed, or the paper misprints it.
IN_PRINT = [
    ("pi_1873", "T1.401", "published/table1.csv", "401,{}", "swap"),
    ("pi_1873", "T1.451", "published/table1.csv", "451,{}", "digit"),
    ("erlang", "T1.4.1", "published/table1.csv", "4,0.869", "4,0.896"),
    ("erlang", "T1.7.2", "published/table1.csv", "2.94", "2.49"),
    ("erlang", "T1.9.5", "published/table1.csv", "5.37", "5.73"),
    ("erlang", "T1.1.5", "published/table1.csv", "0.0526", "0.526"),
    ("erlang", "T1.10.1", "published/table1.csv", "4.46", "-4.46"),
    ("needles", "T1.Wolf.estimate", "published/table1.csv", "3.1596", "3.1569"),
    ("needles", "T1.Fox.crossings", "published/table1.csv", "489", "849"),
    ("needles", "T1.De Morgan.crossings", "published/table1.csv", "382.5", "283.5"),
    ("needles", "T1.Wolf.crossings", "published/table1.csv", "5000,2532", "5000,3252"),
    ("needles", "T1.Lazzarini.crossings", "published/table1.csv", "1808", "8018"),
]
IN_COMPUTATION = [
    ("pi_1873", "T1.401", "reproduced/table1.csv", "401,{}", "digit"),
    ("pi_1873", "T1.511", "reproduced/table1.csv", "511,{}", "swap"),
    ("pi_1873", "S1.arctan", "reproduced/seventy_fifth.csv", "75,8", "75,6"),  # neither print nor meant
    ("erlang", "T1.4.1", "compute.py", "low, high = 0.0, 10.0", "low, high = 1.0, 10.0"),
    ("erlang", "T1.8.2", "compute.py", "traffic * value / (n", "traffic * value / (n + 0.1"),
    ("erlang", "T1.2.5", "compute.py", "target / 100", "target / 10"),
    ("erlang", "T1.6.1", "compute.py", "range(1, lines + 1)", "range(1, lines)"),
    ("erlang", "T1.9.2", "compute.py", "(n + traffic * value)", "(n - traffic * value)"),
    ("needles", "T1.Wolf.estimate", "computations.py", "return 2 * ratio", "return 1.9 * ratio"),
    ("needles", "T1.Reina.estimate", "computations.py", "Finding(_estimate(", "Finding(0.9 * _estimate("),
    ("needles", "T1.Wolf.crossings", "compute.py", "ratio * math.sin", "0.9 * ratio * math.sin"),
    ("needles", "T1.Lazzarini.crossings", "compute.py", "math.pi * uniform()", "math.pi / 2"),
]


def plant(folder, file, old, new):
    """Replace a text; `{}` stands for a number, in which two digits are swapped or one is changed."""
    text = (folder / file).read_text(encoding="utf-8")
    if "{}" in old:
        start = text.index(old.format("")) + len(old.format(""))
        number = text[start:].split("\n", 1)[0]
        k = next(i for i in range(3, 9) if number[i] != number[i + 1])
        wrong = f"{number[:k]}{number[k + 1]}{number[k]}{number[k + 2 :]}"
        if new == "digit":
            wrong = f"{number[:k]}{(int(number[k]) + 1) % 10}{number[k + 1 :]}"
        old, new = number, wrong
    assert text.count(old) >= 1
    (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    if file == "compute.py":
        names = {"__name__": "planted", "__file__": str(folder / file)}
        exec(compile((folder / file).read_text(encoding="utf-8"), str(folder / file), "exec"), names)  # noqa: S102
        names.get("write_all", names["write"])(folder / "reproduced")


def status(folder, item):
    return Judge(load_paper(folder)).explain(item)["status"]


@pytest.mark.parametrize(("paper", "item", "file", "old", "new"), IN_PRINT, ids=lambda v: str(v)[:20])
def test_a_wrong_print_is_seen_and_convicts_the_paper_only_by_a_proof(example, paper, item, file, old, new):
    assert status(EXAMPLES / paper, item) in (AGREES, SCATTER)
    folder = example(paper)
    plant(folder, file, old, new)
    assert status(folder, item) == UNEXPLAINED
    erratum = "planted: {kind: misprint, where: here, printed: wrong, meant: right, proof: OUTCOME}\n"
    errata = (folder / "errata.yaml").read_text(encoding="utf-8")
    facts = (folder / "facts.yaml").read_text(encoding="utf-8")
    name = Judge(load_paper(folder)).claims.items[item].fact
    for passes, expected in (("proved", MISPRINT), ("refuted", UNEXPLAINED)):
        (folder / "errata.yaml").write_text(errata + erratum.replace("OUTCOME", passes), encoding="utf-8")
        (folder / "facts.yaml").write_text(facts.replace(f"{name}: {{", f"{name}: {{erratum: planted, "))
        source = (EXAMPLES / paper / "computations.py").read_text(encoding="utf-8")
        proofs = "\n\ndef proved():\n    return True, 'so'\n\n\ndef refuted():\n    return False, 'no'\n"
        (folder / "computations.py").write_text(source + proofs, encoding="utf-8")
        assert status(folder, item) == expected


@pytest.mark.parametrize(("paper", "item", "file", "old", "new"), IN_COMPUTATION, ids=lambda v: str(v)[:20])
def test_a_wrong_computation_never_convicts_the_paper(example, paper, item, file, old, new):
    folder = example(paper)
    plant(folder, file, old, new)
    assert status(folder, item) == UNEXPLAINED
