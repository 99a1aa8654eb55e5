"""SHA-256 of sources, to detect which code made a result and whether compiled code or results are stale."""

import ast
import hashlib
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent
STATEMENTS = ast.stmt | ast.excepthandler | ast.match_case  # that may contain an import; expressions cannot


def _source(module: str) -> Path | None:
    """File of a pneumo module or package; None if there is no such module."""
    path = ROOT.parent.joinpath(*module.split("."))
    candidates = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in candidates if file.exists()), None)


def imports_of(file: Path) -> set[str]:
    """Modules of pneumo that a Python file imports directly."""
    return {name for name in _imported(file.read_text(encoding="utf-8")) if _source(name)}


@cache
def _imported(text: str) -> frozenset[str]:
    """Dotted names in pneumo that a source imports: modules, and names from them."""
    names: set[str] = set()
    nodes: list[ast.AST] = [ast.parse(text)]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        nodes += [child for child in ast.iter_child_nodes(node) if isinstance(child, STATEMENTS)]
    return frozenset(name for name in names if name.split(".")[0] == "pneumo")


def modules_behind(*modules: str) -> list[str]:
    """Return the given modules of pneumo and all modules that they import, directly or not, sorted."""
    behind: set[str] = set()
    queue = list(modules)
    while queue:
        module = queue.pop()
        file = _source(module)
        if file is None:
            raise ModuleNotFoundError(f"no pneumo module {module!r}")
        if module not in behind:
            behind.add(module)
            queue += imports_of(file)
    return sorted(behind)


def code_hash(*modules: str) -> str:
    """Return the SHA-256 of the named pneumo modules and of all pneumo modules that they import."""
    return _digest(modules, lambda text: text)


def compiled_hash(*modules: str) -> str:
    """Return the same hash without comments, docstrings and layout, which do not change compiled code."""
    return _digest(modules, _meaning)


def _digest(modules: Iterable[str], content: Callable[[str], str]) -> str:
    digest = hashlib.sha256()
    for module in modules_behind(*modules):
        source = _source(module)
        assert source is not None
        text = content(source.read_text(encoding="utf-8"))
        digest.update(module.encode() + b"\0" + text.encode() + b"\0")
    return digest.hexdigest()


@cache
def _tree(text: str) -> ast.Module:
    """Syntax tree of a source without docstrings."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [statement for statement in node.body if not _is_text(statement)]
    return tree


@cache
def _meaning(text: str) -> str:
    """Syntax tree of a source as text, without docstrings."""
    return ast.dump(_tree(text))


def _is_text(statement: ast.stmt) -> bool:
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)
