"""Numbers of the papers in HEPData's form: valid, complete, and with their errors."""

import json
import sys

import pytest
import yaml
from checkout import ROOT
from hepdata_validator.full_submission_validator import FullSubmissionValidator

from pneumo.papers import PAPERS
from pneumo.publish.records import data_table, numbers_by_table
from pneumo.verdict.claims import read_claims

sys.path.insert(0, str(ROOT / "workflow"))
import records

CLAIMS = read_claims(PAPERS / "2006")


def cell(name, reproduced):
    return CLAIMS.items[name], {"id": name, "reproduced": reproduced}


def test_a_table_has_two_columns_for_each_of_the_papers_and_a_dash_where_it_prints_none():
    table = data_table([cell("T7.M8.mse", 1.15e7), cell("T7.M8.mu", 84.0), cell("T7.M9.mse", 1.1e7)])
    (row,) = table["independent_variables"]
    assert [value["value"] for value in row["values"]] == ["M8", "M9"]
    names = [(c["header"]["name"], c["qualifiers"][0]["value"]) for c in table["dependent_variables"]]
    assert names == [(c, s) for c in ("mse", "mu") for s in ("printed", "reproduced")]
    printed, reproduced, mu, _ = table["dependent_variables"]
    assert printed["values"][0] == {
        "value": 1.16e7,
        "errors": [{"symerror": 5e4, "label": "last printed digit or reading"}],
    }
    (error,) = reproduced["values"][0]["errors"]
    assert error == {"symerror": CLAIMS.items["T7.M8.mse"].seed_deviation, "label": "other seeds"}
    assert mu["values"][1] == {"value": "-"}


def test_a_row_names_its_level_and_an_interval_is_given_by_its_middle():
    table = data_table([cell("T9.typical.M8.mse", [1e6, 2e6])])
    assert table["independent_variables"][0]["values"] == [{"value": "typical, M8"}]
    (value,) = table["dependent_variables"][1]["values"]
    assert value["value"] == 1.5e6 and value["errors"][0]["symerror"] == 5e5


@pytest.mark.results
def test_both_papers_tables_are_valid_and_complete(results, tmp_path):
    records.main(results, tmp_path)
    for name, folder in (("2006", "."), ("2007", "2007")):
        validator = FullSubmissionValidator(schema_version="1.1.1")
        assert validator.validate(directory=str(tmp_path / name)), validator.messages
        judged = json.loads((results / folder / "verdict.json").read_text(encoding="utf-8"))["items"]
        cells = numbers_by_table(read_claims(PAPERS / name), judged)
        written = {
            file.stem: yaml.safe_load(file.read_text()) for file in (tmp_path / name).glob("[TF]*.yaml")
        }
        assert set(written) == set(cells)
        for table, content in written.items():
            columns = content["dependent_variables"]
            values = [v["value"] for column in columns for v in column["values"]]
            assert sum(value != "-" for value in values) == 2 * len(cells[table]), table


@pytest.mark.results
def test_a_file_without_a_unit_column_or_with_a_lost_value_is_not_valid(results, tmp_path):
    records.main(results, tmp_path)
    file = tmp_path / "2006/T7.yaml"
    content = yaml.safe_load(file.read_text())
    content["dependent_variables"][0]["values"].pop()
    file.write_text(yaml.safe_dump(content))
    assert not FullSubmissionValidator(schema_version="1.1.1").validate(directory=str(tmp_path / "2006"))
