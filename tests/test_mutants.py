"""Mutants that are listed as survivors: each is of lines that are there, once, with a reason."""

from collections import Counter

from checkout import ROOT

from tests.mutations import survivors


def test_each_listed_mutant_is_of_lines_that_are_there():
    modules = {each["module"]: (ROOT / "pneumo" / each["module"]).read_text() for each in survivors()}
    joined = {name: " ".join(map(str.strip, text.splitlines())) for name, text in modules.items()}
    gone = [each for each in survivors() if each["before"] not in joined[each["module"]]]
    assert survivors() and not gone


def test_each_is_listed_once_with_a_reason():
    listed = Counter((each["module"], each["before"], each["after"]) for each in survivors())
    assert max(listed.values()) == 1
    assert all(each["reason"] and each["before"] != each["after"] for each in survivors())
