"""Export of a model of a configured cylinder."""

from pathlib import Path

from pneumo.configuration.schema import Configuration
from pneumo.export import exported, write_files
from pneumo.selection.plants import configured_rig


def export_model(
    configuration: Configuration,
    cylinder: str,
    model: str,
    n: float | None,
    to: str,
    file: Path | str,
    name: str | None = None,
) -> list[Path]:
    """Write a model of a configured cylinder as `pneumo export` does; return the files' paths."""
    file = Path(file)
    _, plant, dynamics = configured_rig(configuration, cylinder)
    files = exported(model, n, plant, to, stem=file.stem, dynamics=dynamics, name=name)
    write_files(files, file.parent)
    return [file.parent / written for written in files]
