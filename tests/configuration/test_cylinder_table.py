"""Tables of cylinders: what a row becomes, and one line with row and column for whatever is wrong."""

import json

import pytest
import yaml

from pneumo.configuration.parameters import load, read_sources, study
from pneumo.configuration.plausible_cylinders import checked
from pneumo.errors import ConfigurationError, as_lines
from pneumo.selection.cylinder_template import TEMPLATE

HEAD = "name,bore_mm,stroke_mm,mass_kg,friction_Ns_per_m,k_x_k_u_m2_per_V,u_max_V,seed,sample_time_s"
HEAD += ",open_loop.amplitude_V,open_loop.reverse_at"
ROW = "40,200,8,100,1e-6,10,3,0.05,0.8,0.9"
SLOW = {"loop": "open", "k_0_W_per_K": 0.3, "duration_s": 2.0}
COMMON = yaml.safe_load(TEMPLATE.read_text()) | {"cylinders": "fleet.csv", "experiments": {"slow": SLOW}}
COMMON |= {"run": {"experiments": ["slow"], "seeds": 2}}


@pytest.fixture
def fleet(tmp_path):
    """Write a configuration, with changes, and its table in a folder; give the configuration's path."""
    folder = tmp_path / "plants"
    folder.mkdir()

    def write(*rows, head=HEAD, encoding="utf-8", **changes):
        (folder / "fleet.csv").write_bytes("\n".join([head, *rows]).encode(encoding))
        (folder / "fleet.yaml").write_text(json.dumps(COMMON | changes))
        return folder / "fleet.yaml"

    return write


def refusal(*files):
    with pytest.raises(ConfigurationError) as error:
        load(*files)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_each_row_is_a_cylinder_with_every_experiment_that_runs(fleet):
    experiments = {"slow": SLOW, "long": SLOW | {"duration_s": 4.0}, "other": SLOW}
    head = f"{HEAD},rod_mm,k_0_W_per_K,duration_s"
    rows = f"a,{ROW},,,", "", f" b-2 , {ROW},16,0.5,3", ",,"
    file = fleet(*rows, head=head, experiments=experiments, run={"experiments": ["slow", "long"]})
    experiments = study(load(file)).experiments
    assert list(experiments) == ["a-slow", "a-long", "b-2-slow", "b-2-long"]
    assert [e.cylinder for e in experiments.values()] == ["a", "a", "b-2", "b-2"]
    assert [e.plant.k_0 for e in experiments.values()] == [0.3, 0.3, 0.5, 0.5]
    assert [e.steps for e in experiments.values()] == [2000, 4000, 3000, 3000]
    plain, rodded = experiments["a-slow"].plant.cylinder, experiments["b-2-slow"].plant.cylinder
    assert plain.A_A == plain.A_B == rodded.A_A > rodded.A_B
    # Written out in the configuration, the same cylinder is the same.
    keys = HEAD.split(",")[1:-2]
    section = dict(zip(keys, ROW.split(","), strict=False))
    section |= {"open_loop": {"amplitude_V": 0.8, "reverse_at": 0.9}}
    written = SLOW | {"cylinder": "a"}
    plain_file = fleet(cylinders={"a": section}, experiments={"a-slow": written}, run={})
    assert study(load(plain_file)).experiments["a-slow"] == experiments["a-slow"]


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_semicolons_tabs_and_a_byte_order_mark(fleet, delimiter):
    head, row = (text.replace(",", delimiter) for text in (HEAD, f"a,{ROW}"))
    file = fleet(row, head=head, encoding="utf-8-sig")
    assert list(study(load(file)).experiments) == ["a-slow"]


def test_the_tables_path_starts_at_the_configuration_that_names_it(fleet, tmp_path):
    first = fleet(f"a,{ROW}")
    (tmp_path / "other.csv").write_text(f"{HEAD}\nz,{ROW}")
    (tmp_path / "above.yaml").write_text("cylinders: other.csv")
    assert list(load(first, tmp_path / "above.yaml").cylinders) == ["z"]
    (tmp_path / "above.yaml").write_text("run: {seeds: 3}")
    assert list(load(first, tmp_path / "above.yaml").cylinders) == ["a"]


BORE = ROW.replace("40", "-40", 1)


@pytest.mark.parametrize(
    ("rows", "head", "words"),
    [
        ([f"a,{ROW}", "", f"b,{BORE}"], HEAD, ["row 4, column bore_mm = -40", "greater than 0 and at most"]),
        ([f"a,{BORE.replace('-40', 'wide')}"], HEAD, ["row 2, column bore_mm = 'wide': must be a number"]),
        ([f"a,{BORE.replace('-40', '')}"], HEAD, ["row 2, column bore_mm: missing; must be a number"]),
        ([f"a,{ROW.replace('1e-6', '')}"], HEAD, ["column k_x_k_u_m2_per_V: missing", "or give valve"]),
        ([f"a,{ROW},50"], f"{HEAD},rod_mm", ["row 2, column bore_mm = 40.0: must exceed rod_mm = 50"]),
        ([f"a,{ROW},1", f"b,{ROW},-1"], f"{HEAD},k_0_W_per_K", ["row 3, column k_0_W_per_K = -1"]),
        ([f"1,{ROW}"], HEAD, ["row 2, column name = '1': the name must be text of at most 40 letters"]),
        ([f"a,{ROW}", f"a,{ROW}"], HEAD, ["row 3, column name = 'a': duplicate of row 2"]),
        ([f"a,{ROW},7"], f"{HEAD},bore_cm", ["row 1, column 'bore_cm': unknown", "bore_mm"]),
        ([f"a,{ROW},7"], f"{HEAD},bore_mm", ["row 1, column bore_mm: appears twice"]),
        ([ROW], HEAD.removeprefix("name,"), ["row 1: no column name"]),
        ([], HEAD, ["no rows"]),
    ],
)
def test_a_mistake_is_one_line_with_row_and_column(fleet, rows, head, words):
    file = fleet(*rows, head=head)
    message = refusal(file)
    assert message.startswith(f"{file.with_name('fleet.csv')}: ") and all(word in message for word in words)


def test_a_row_with_too_many_cells_is_named(fleet):
    assert "cylinders = 'fleet.csv': " in (message := refusal(fleet(f"a,{ROW},7")))
    assert "Expected 11 fields in line 2, saw 12" in message


def test_all_bad_rows_are_named_at_once_each_in_a_line(fleet):
    file = fleet(f"a,{BORE}", f"b,{ROW}", f"c,{BORE}")
    with pytest.raises(ConfigurationError) as error:
        checked(read_sources(file), trust=True)
    for line, row in zip(as_lines(error.value).splitlines(), (2, 4), strict=True):
        assert line.startswith(
            f"pneumo: {file.with_name('fleet.csv')}: row {row}, column bore_mm = -40: must"
        )


def test_mistakes_of_the_configuration_are_named_where_they_are_written(fleet):
    for change, words in (
        ({"duration_s": -1}, "fleet.yaml: experiments.slow.duration_s = -1: must be"),
        ({"loop": "closed"}, "fleet.yaml: experiments.slow.loop = 'closed': needs the section"),
        ({"cylinder": "a"}, "experiments.slow.cylinder = 'a': not allowed with a table of cylinders"),
    ):
        assert words in refusal(fleet(f"a,{ROW}", experiments={"slow": SLOW | change}))
    assert "no such experiment" in refusal(fleet(f"a,{ROW}", run={"experiments": ["fast"]}))
    assert "experiments = 7" in refusal(fleet(f"a,{ROW}", experiments=7))
    twice = {"slow": SLOW, "b-slow": dict(SLOW)}
    file = fleet(f"a,{ROW}", f"a-b,{ROW}", experiments=twice, run={})
    assert "would have the name a-b-slow" in refusal(file)
