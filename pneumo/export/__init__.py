"""Models as source code and FMUs, printed from `pneumo.equations.equation_list`."""

from pneumo.export.targets import TARGETS, exported, write_files

__all__ = ["TARGETS", "exported", "write_files"]
