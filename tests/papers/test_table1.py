"""Table 1, generated from the table of models, against the printed one."""

from pneumo.papers.paper_2006.table1 import PAPER_MODELS, table_1_row
from pneumo.verdict.published import read_table


def test_table_1_follows_from_the_table_of_models():
    rows = {name: table_1_row(model) for name, model in PAPER_MODELS.items()}
    derived = [(name, column, cell) for name, row in rows.items() for column, cell in row.items()]
    assert derived == [(cell["row"], cell["column"], cell["printed"]) for cell in read_table(1)]
