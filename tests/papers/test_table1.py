"""Table 1, generated from the table of models, against the printed one."""

from pneumo.papers.paper_2006.table1 import table_1
from pneumo.verdict.published import read_table


def test_generated_table_is_the_printed_one():
    mark = {True: "✓", False: "×"}
    ours = {
        (row.model, column): cell
        for row in table_1()
        for column, cell in {
            "wall_heat": mark[row.wall_heat],
            "mixing": mark[row.mixing],
            "temperature": row.temperature,
            "index": row.pressure_index,
        }.items()
    }
    printed = {(cell["row"], cell["column"]): cell["printed"] for _, cell in read_table(1).iterrows()}
    assert ours == printed
    assert list(ours) == list(printed)  # in the same order
