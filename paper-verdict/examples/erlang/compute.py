"""Offered traffic at which a group of lines loses a fraction of the calls: writes reproduced/traffic.json."""

import json
from pathlib import Path

HERE = Path(__file__).parent


def loss(traffic: float, lines: int) -> float:
    """Erlang's loss formula, by its recursion over the lines."""
    value = 1.0
    for n in range(1, lines + 1):
        value = traffic * value / (n + traffic * value)
    return value


def traffic_at(target: float, lines: int) -> float:
    """Traffic with a given loss, by bisection."""
    low, high = 0.0, 10.0 * lines
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if loss(middle, lines) < target else (low, middle)
    return low


def write(folder: Path) -> None:
    """Write the folder of reproduced values."""
    folder.mkdir(exist_ok=True)
    records = [
        {"lines": lines, "loss": target, "traffic": traffic_at(target / 100, lines)}
        for lines in range(1, 11)
        for target in (1, 2, 5)
    ]
    (folder / "traffic.json").write_text(json.dumps({"records": records}, indent=1))


if __name__ == "__main__":
    write(HERE / "reproduced")
