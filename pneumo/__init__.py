"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged.

The stub beside this file lists the public names. Their modules are loaded on first use: `import pneumo` alone
imports no numerics.
"""

import re
from pathlib import Path

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_MODULE_OF = {name: module for module, name in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)}
__all__ = ["__version__", *sorted(_MODULE_OF)]  # pyright: ignore[reportUnsupportedDunderAll]


def __dir__() -> list[str]:
    """Public names, loaded or not."""
    return __all__


def __getattr__(name: str) -> object:
    """Load a public name on first use."""
    if name == "__version__":
        from importlib.metadata import version

        return version("pneumo")
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_MODULE_OF[name]), name)
