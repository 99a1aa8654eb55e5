"""Generated blocks of README.md: `make numbers` writes them, `make lint` checks that they are current."""

from fragments import stored_numbers


def study_answer() -> str:
    """What `pneumo study` answers for the template's cylinder."""
    return f"```text\n{stored_numbers()['study']['answer']}\n```"


def judged() -> str:
    """How many facts of the paper of 2006 agree."""
    return stored_numbers()["verdict"]["headline"]
