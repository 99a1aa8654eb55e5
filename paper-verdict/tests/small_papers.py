"""Papers for the tests: the examples, and a small one that is written."""

from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = sorted(folder.name for folder in EXAMPLES.iterdir() if (folder / "claims.yaml").is_file())

TOY = {
    "published/table1.csv": "liquid,density [kg m-3],boils [degC]\nwater,998,101\nethanol,789,78\n",
    "reproduced/table1.csv": "liquid,density [kg m-3],boils [degC]\nwater,998.2,99.97\nethanol,789.3,78.2\n",
    "claims.yaml": """\
classes:
  printed: {limit: 0, measure: absolute}
  about: {limit: 0.05, measure: relative}
  statement: {limit: 0, measure: truth}
tables:
  - table: 1
    class: {density: printed, boils: about}
claims:
  - id: S1.lighter
    where: Section 1
    statement: ethanol is lighter
    printed: "true"
    class: statement
    compute: lighter
  - id: S1.mean
    where: Section 1
    statement: mean density
    printed: "894"
    unit: kg m-3
    class: about
    values: {file: table1.csv, variable: density, reduce: mean}
""",
    "facts.yaml": """\
table: {says: The numbers of Table 1, basis: prediction, items: ["T1.*"]}
text: {says: Ethanol is lighter, basis: prediction, items: ["S1.*"]}
""",
    "errata.yaml": "{}\n",
    "assumptions.yaml": "{}\n",
    "computations.py": """\
def lighter(results):
    return 789.3 < 998.2


def boils_at_100():
    return True, "at 101325 Pa"
""",
}
