"""Slips of those who judge: each is one line that names the file, the place and remedy; none is silent."""

import pytest

from paper_verdict.command import main

PRINT = "published/table1.csv"
OURS = "reproduced/table1.csv"
CLAIMS = "claims.yaml"
ERRATUM = """\
boiling:
  {kind: misprint, where: Table 1, printed: "101", meant: "100", proof: PROOF, values: {ITEM: VALUE}}
"""


def erratum(proof="boils_at_100", item="T1.water.boils", value="'100'"):
    return ERRATUM.replace("PROOF", proof).replace("ITEM", item).replace("VALUE", value)


SLIPS = {  # name -> file, text, in its place, and words of the line
    "decimal comma": (PRINT, "998,101", '"998,5",101', [f"{PRINT}:2", "'998,5'", "decimal point"]),
    "typographic minus": (PRINT, "998", "−998", [f"{PRINT}:2", "write -"]),
    "approximate sign": (PRINT, "998", "~998", [f"{PRINT}:2", "'~998'", "wider class"]),
    "power of ten": (PRINT, "998", "9.98×10^2", [f"{PRINT}:2", "1.2e7"]),
    "per cent": (PRINT, ",101", ",101%", [f"{PRINT}:2", "scale 0.01"]),
    "letter for a digit": (PRINT, "789", "7B9".replace("B", "O"), [f"{PRINT}:3", "letter"]),
    "uncertainty": (PRINT, "998", "998±2", [f"{PRINT}:2", "column sigma"]),
    "two points": (PRINT, "998", "9.9.8", [f"{PRINT}:2", "two decimal points"]),
    "sign apart": (PRINT, "998", "- 998", [f"{PRINT}:2", "space after its sign"]),
    "no number": (PRINT, ",101", ",warm", [f"{PRINT}:2", "is not a number"]),
    "empty cell": (PRINT, ",101", ",", [f"{PRINT}:2", "is empty", "blank"]),
    "row twice": (
        PRINT,
        "ethanol,789,78\n",
        "water,789,78\n",
        [f"{PRINT}:3", "T1.water.density", "repeated"],
    ),
    "field too many": (PRINT, "998,101", "998,101,5", [f"{PRINT}:2", "has 4 fields"]),
    "semicolons": (PRINT, ",", ";", [f"{PRINT}:1", "semicolons"]),
    "column twice": (PRINT, "boils [degC]", "density [kg m-3]", [f"{PRINT}:1", "two columns"]),
    "empty result": (OURS, "998.2", "", [f"{OURS}:2", "is empty", "write the reproduced number"]),
    "comma in a result": (OURS, "998.2", '"998,2"', [f"{OURS}:2", "decimal point"]),
    "misspelt row of results": (OURS, "ethanol", "etanol", [OURS, "liquid = ethanol", "'etanol'"]),
    "misspelt column of results": (OURS, "boils", "boil", [f"{OURS}:1", "'boils'", "'boil'"]),
    "row of results twice": (
        OURS,
        "ethanol,789.3,78.2\n",
        "ethanol,789.3,78.2\n" * 2,
        [f"{OURS}:4", "3 and 4"],
    ),
    "other unit": (OURS, "kg m-3", "g cm-3", [OURS, "g cm-3", "kg m-3", "factor"]),
    "misspelt key": (
        CLAIMS,
        "statement: mean",
        "statment: mean",
        [f"{CLAIMS}:15", "statment", "'statement'"],
    ),
    "misspelt section": (CLAIMS, "\nclaims:", "\nclaim:", [CLAIMS, "claim: unknown key", "'claims'"]),
    "misspelt class": (CLAIMS, "class: about", "class: abuot", [f"{CLAIMS}:15", "'abuot'", "'about'"]),
    "misspelt computation": (CLAIMS, "lighter\n  - id", "ligter\n  - id", [f"{CLAIMS}:9", "'lighter'"]),
    "misspelt placeholder": (
        CLAIMS,
        "table: 1",
        "table: 1\n    id: T1.{roww}",
        [f"{PRINT}:2", "'roww'", "'row'"],
    ),
    "misspelt reduction": (CLAIMS, "reduce: mean", "reduce: meen", [f"{CLAIMS}:15", "'mean'"]),
    "key twice": (
        CLAIMS,
        "class: about",
        "class: about\n    class: printed",
        [f"{CLAIMS}:21", "is there twice"],
    ),
    "id twice": (CLAIMS, "S1.mean", "S1.lighter", [f"{CLAIMS}:15", "repeated", f"{CLAIMS}:9"]),
    "number without quotes": (CLAIMS, '"894"', "894", [f"{CLAIMS}:15", "printed = 894", "in quotes"]),
    "truth without quotes": (CLAIMS, '"true"', "true", [f"{CLAIMS}:9", "in quotes"]),
    "negative tolerance": (
        CLAIMS,
        "limit: 0.05",
        "limit: -0.05",
        [f"{CLAIMS}:3", "classes.about.limit = -0.05"],
    ),
    "seeds without deviations": (
        CLAIMS,
        "limit: 0.05,",
        "limit: 0.05, seeds: 1,",
        [CLAIMS, "about.seeds", "repeats"],
    ),
    "repeats that match nothing": (
        CLAIMS,
        "claims:",
        "repeats: runs/*\nclaims:",
        [CLAIMS, "runs/*", "0 folders"],
    ),
    "missing table": (CLAIMS, "table: 1", "table: 2", ["published/table1.csv", "has no rule"]),
    "missing file of results": (
        CLAIMS,
        "file: table1",
        "file: tabel1",
        ["tabel1.csv: no such file", "'table1.csv'"],
    ),
    "broken YAML": (CLAIMS, "class: about", "class: [about", [CLAIMS, "expected"]),
    "item without a fact": ("facts.yaml", '"S1.*"', '"S1.m*"', ["facts.yaml", "'S1.lighter'", "add it"]),
    "pattern without an item": (
        "facts.yaml",
        '["S1.*"]',
        '["S1.*", T2.x]',
        ["facts.yaml", "'T2.x' matches no item"],
    ),
    "fact without an item": (
        "facts.yaml",
        "text: {",
        'late: {says: twice, basis: prediction, items: ["T1.*"]}\ntext: {',
        ["facts.yaml: late", "facts before it"],
    ),
    "unknown assumption": (
        "facts.yaml",
        'basis: prediction, items: ["S1',
        'basis: prediction, chosen: [lag], items: ["S1',
        ["facts.yaml", "'lag'"],
    ),
    "erratum of no item": (
        "errata.yaml",
        "{}\n",
        erratum(item="T1.wter.boils"),
        ["errata.yaml", "'T1.water.boils'"],
    ),
    "misspelt proof": (
        "errata.yaml",
        "{}\n",
        erratum(proof="boils_at_10"),
        ["errata.yaml:2", "'boils_at_100'"],
    ),
    "erratum that nothing names": (
        "errata.yaml",
        "{}\n",
        erratum(),
        ["errata.yaml", "does not name this erratum"],
    ),
    "meant is printed": (
        "errata.yaml",
        "{}\n",
        erratum(value="'101'"),
        ["errata.yaml", "is what is printed"],
    ),
    "text returned for a truth": (
        "computations.py",
        "789.3 < 998.2",
        "998.2",
        [f"{CLAIMS}:9", "True or False"],
    ),
    "nothing returned": (
        "computations.py",
        "return 789.3 < 998.2",
        "789.3 < 998.2",
        [f"{CLAIMS}:9", "returned None"],
    ),
}


def spoil(folder, file, old, new):
    text = (folder / file).read_text(encoding="utf-8")
    assert old in text
    (folder / file).write_text(text.replace(old, new), encoding="utf-8")


def test_the_paper_itself_agrees(toy, capsys):
    assert main(["check", str(toy)]) == 0
    assert "Table 1  4 of 4 agree" in capsys.readouterr().out


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_one_line_with_file_place_and_remedy(toy, capsys, slip):
    file, old, new, words = SLIPS[slip]
    spoil(toy, file, old, new)
    assert main(["check", str(toy)]) == 2
    out, err = capsys.readouterr()
    last = err.splitlines()[-1]
    if "Traceback" in err:  # a function of the user's own: its note names the item
        last = err
    else:
        assert out == "" and err.count("\n") == 1
    assert all(word in last for word in words), err


@pytest.mark.parametrize("bug", ["{}['oops']", "1 / 0", "undefined"])
def test_a_mistake_in_the_users_code_shows_their_traceback_and_the_item(toy, capsys, bug):
    spoil(toy, "computations.py", "return 789.3 < 998.2", f"return {bug}")
    assert main(["check", str(toy)]) == 2
    err = capsys.readouterr().err
    assert "Traceback" in err and f"return {bug}" in err and "claims.yaml:9: S1.lighter: lighter" in err
    assert "judging.py" not in err


def test_results_that_may_be_missing_are_not_judged(toy, capsys):
    spoil(toy, CLAIMS, "reduce: mean}", "reduce: mean, missing: allowed}")
    spoil(toy, CLAIMS, "file: table1.csv", "file: later.csv")
    assert main(["check", str(toy)]) == 0
    assert "Text     1 of 1 agree; 1 not judged" in capsys.readouterr().out
