"""Generated blocks of README.md: `make numbers` writes them, `make lint` checks that they are current."""

from fragments import stored_numbers


def study_answer() -> str:
    """What `pneumo study` answers for the template's cylinder."""
    return f"```text\n{stored_numbers()['study']['answer']}\n```"


def judged() -> str:
    """How many facts of both papers agree."""
    verdict = stored_numbers()["verdict"]
    return f"{verdict['headline']}\nThe sequel of 2007: {verdict['second']}"
