"""SHA-256 of sources, to detect which code made a result and whether compiled code or results are stale."""

import ast
import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent
# They open, lock, write and refuse files: no number of a result depends on them (decision 110).
WITHOUT_NUMBERS = {
    *(
        "pneumo.errors",
        "pneumo.hashing",
        "pneumo.regular_file",
        "pneumo.jobs.run_lock",
        "pneumo.jobs.wrapper",
    ),
    *("pneumo.storage.files", "pneumo.storage.kept_evidence", "pneumo.storage.seal"),
}
STATEMENTS = ast.stmt | ast.excepthandler | ast.match_case  # that may contain an import; expressions cannot


def _source(module: str) -> Path | None:
    """File of a module or package of pneumo or, in a checkout, of `paper.study`; None if there is none."""
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
    return frozenset(name for name in names if name.split(".")[0] in ("pneumo", "paper"))


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
    """Return the SHA-256 of the named pneumo modules and of all pneumo modules that they import.

    It changes with the meaning of a Python source only: not with comments, docstrings or layout, nor with
    modules `WITHOUT_NUMBERS`.
    """
    digest = hashlib.sha256()
    for module in sorted(set(modules_behind(*modules)) - WITHOUT_NUMBERS):
        source = _source(module)
        assert source is not None
        digest.update(module.encode() + b"\0" + _meaning(source.read_text(encoding="utf-8")).encode() + b"\0")
        if source.name == "__init__.py":  # of a package with sources in C: the core
            for file in sorted(source.parent.glob("*.[ch]")):
                digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


@cache
def _meaning(text: str) -> str:
    """Syntax tree of a source as text, without docstrings; the same in every version of Python."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [statement for statement in node.body if not _is_text(statement)]
        elif isinstance(node, ast.JoinedStr):  # early releases of 3.12 end some with an empty text
            node.values = [value for value in node.values if getattr(value, "value", None) != ""]
    return _dump(tree)


def _dump(part: object) -> str:
    """Text of a syntax tree without empty fields: which of them `ast.dump` prints depends on the version."""
    if isinstance(part, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(part) if value is not None and value != [])
        return f"{type(part).__name__}({', '.join(f'{name}={_dump(value)}' for name, value in fields)})"
    return f"[{', '.join(map(_dump, part))}]" if isinstance(part, list) else repr(part)


def _is_text(statement: ast.stmt) -> bool:
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)
