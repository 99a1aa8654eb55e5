"""Tables in Parquet files that a user names, read with DuckDB where it is installed."""

import glob
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pneumo.errors import ConfigurationError, printable

# Of DuckDB, which otherwise takes all processors and most of the memory, and asks the net for extensions.
LIMITS: dict[str, Any] = {"threads": 1, "memory_limit": "500MB", "autoinstall_known_extensions": False}
ROWS = 1000  # at a time


def parquet_rows(file: Path, largest: int, named: str) -> Iterator[list[str]]:
    """Yield the names of the columns, then every row, each value as text; a null is empty.

    Parameters
    ----------
    file
        Path of the file.
    largest
        Bytes that the rows may have as text; they are counted while they are read.
    named
        How an error message names the file.

    Raises
    ------
    ConfigurationError
        If DuckDB is missing, the file cannot be read or is too large.
    """
    try:
        import duckdb
    except ImportError:
        problem = "a Parquet file is read with DuckDB, which is not installed; pip install duckdb"
        raise ConfigurationError(f"{named}: {problem}") from None
    query = "SELECT COLUMNS(*)::VARCHAR FROM read_parquet(?, hive_partitioning = false)"
    size = 0
    try:
        file.open("rb").close()  # DuckDB would take a folder for all files in it
        with duckdb.connect(config=LIMITS) as connection:
            result = connection.execute(query, [glob.escape(str(file))])
            yield [column[0] for column in result.description or ()]
            while chunk := result.fetchmany(ROWS):
                rows = [[cell or "" for cell in row] for row in chunk]
                size += sum(len(cell) + 1 for row in rows for cell in row)
                if size > largest:
                    break
                yield from rows
    except (OSError, ValueError, duckdb.Error) as error:
        raise ConfigurationError(f"{named}: cannot be read: {printable(str(error), 300)}") from None
    if size > largest:
        raise ConfigurationError(f"{named}: must have at most {largest} bytes as text")
