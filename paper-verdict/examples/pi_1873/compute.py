"""Places of pi and of arctan(1/5), by Machin's formula in integers: writes reproduced/."""

from pathlib import Path

DIGITS = 730
HERE = Path(__file__).parent


def arctan_of_inverse(x: int, scale: int) -> int:
    """Arctan(1/x) times a scale, by its series."""
    term = scale // x
    total = term
    k = 1
    while term:
        term //= -x * x
        k += 2
        total += term // k
    return total


def pi_digits() -> str:
    """Digits of pi after the point: 16 arctan(1/5) - 4 arctan(1/239)."""
    scale = 10**DIGITS
    return str(16 * arctan_of_inverse(5, scale) - 4 * arctan_of_inverse(239, scale))[1:]


def arctan_digits() -> str:
    """Digits of arctan(1/5) after the point."""
    return str(arctan_of_inverse(5, 10**DIGITS)).zfill(DIGITS)


def write(folder: Path) -> None:
    """Write the folder of reproduced values."""
    folder.mkdir(exist_ok=True)
    digits = pi_digits()
    rows = [f"{start},{digits[start - 1 : start + 9]}" for start in range(401, 601, 10)]
    (folder / "table1.csv").write_text("\n".join(["from,digits", *rows, ""]))
    (folder / "seventy_fifth.csv").write_text(f"place,digit\n75,{arctan_digits()[74]}\n")


if __name__ == "__main__":
    write(HERE / "reproduced")
