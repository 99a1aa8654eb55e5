"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged."""

# `import pneumo` loads nothing else: numerics take long, and Ctrl-C would meet a traceback before `main`.


def _modules() -> dict[str, str]:
    """Module of each public name, as the stub for type checkers imports it."""
    import re
    from pathlib import Path

    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    return {name: module for module, name in re.findall(r"from (\S+) import (\w+) as", stub)}


def __dir__() -> list[str]:
    """Public names, loaded or not."""
    return ["__version__", *sorted(_modules())]


def __getattr__(name: str) -> object:
    """Load a public name on first use."""
    if name == "__all__":
        return __dir__()
    if name == "__version__":
        from importlib.metadata import version

        return version("pneumo")
    module = None if name.startswith("_") else _modules().get(name)
    if module is None:
        raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
    from importlib import import_module

    return globals().setdefault(name, getattr(import_module(module), name))
