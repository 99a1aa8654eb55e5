"""Throws of Buffon's needle: writes reproduced/crossings.csv, and seeds/ with other random numbers."""

import math
import random
from pathlib import Path

HERE = Path(__file__).parent
EXPERIMENTS = {  # needle over distance, throws
    "Wolf": (0.8, 5000),
    "Smith": (0.6, 3204),
    "De Morgan": (1.0, 600),
    "Fox": (0.75, 1030),
    "Lazzarini": (0.83, 3408),
    "Reina": (0.5419, 2520),
}


def crossings(ratio: float, throws: int, random_numbers: random.Random) -> int:
    """Needles that cross a line."""
    uniform = random_numbers.random
    return sum(uniform() < ratio * math.sin(math.pi * uniform()) for _ in range(throws))


def write(folder: Path, seed: int = 1777) -> None:
    """Write crossings with one seed."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = random.Random(seed)
    rows = [f"{name},{crossings(*given, numbers)}" for name, given in EXPERIMENTS.items()]
    (folder / "crossings.csv").write_text("\n".join(["who,crossings", *rows, ""]))


def write_all(folder: Path, others: int = 20) -> None:
    """Write the folder of reproduced values, with its repetitions."""
    write(folder)
    for seed in range(1, others + 1):
        write(folder / f"seeds/{seed:02d}", seed)


if __name__ == "__main__":
    write_all(HERE / "reproduced")
