"""The paper, number by number: every item of the verdict has the status that is recorded for it.

A number that gets worse fails, and so does one that gets better without being recorded:
``pneumo paper verdict --record`` writes paper/2006/statuses.csv anew.
"""

import pytest

from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.verdict.judging import Judge, read_statuses

RECORDED = read_statuses(PAPER_FOLDER)

pytestmark = pytest.mark.results


@pytest.fixture(scope="module")
def judge(results) -> Judge:
    return Judge(results, PAPER_2006)


@pytest.mark.parametrize(("name", "status"), RECORDED.items(), ids=RECORDED.keys())
def test_item(judge, name, status):
    item = judge.judge(judge.claims.items[name])
    assert item["status"] == status, f"{name}: {item['shown']} for {item['printed']}; {item['reason']}"
