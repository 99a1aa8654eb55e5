"""Models as source code and FMUs, printed from `pneumo.engineer.equations`."""

from pneumo.engineer.export.files import TARGETS, exported, write_files

__all__ = ["TARGETS", "exported", "write_files"]
