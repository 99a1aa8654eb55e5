"""The paper, fact by fact: every fact of the verdict has the status that is recorded for it.

A fact that gets worse fails, and so does one that gets better without being recorded:
``pneumo paper verdict --record`` writes paper/2006/statuses.csv anew.
"""

import pytest

from paper.study.known_papers import current_verdict
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.verdict.judging import recorded_facts

RECORDED = recorded_facts(PAPER_FOLDER)

pytestmark = pytest.mark.results


@pytest.fixture(scope="module")
def facts(results) -> dict[str, dict]:
    return {fact["name"]: fact for fact in current_verdict(results, "2006")["facts"]}


@pytest.mark.parametrize(("name", "status"), RECORDED.items(), ids=RECORDED.keys())
def test_fact(facts, name, status):
    assert facts[name]["status"] == status, facts[name]
