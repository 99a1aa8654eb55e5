"""Generated blocks of README.md: `make numbers` writes them, `make lint` checks that they are current."""

from fragments import stored_numbers


def study_answer() -> str:
    """What `pneumo study` answers for the template's cylinder."""
    return f"```text\n{stored_numbers()['study']['answer']}\n```"


def judged() -> str:
    """Conclusion on the paper of 2006, its facts by status, and its numbers by table and figure."""
    verdict = stored_numbers()["verdict"]
    return f"{verdict['conclusion']} {verdict['headline']}\n\n{verdict['places']}"


def printed() -> str:
    """Output of README's look at the results."""
    return f"```text\n{stored_numbers()['look']['output']}\n```"
