"""The reference page of the package, docs/reference/python.md: signatures and docstrings, read from the sources."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

HERE = Path(__file__).parent
#: The page in a checkout. A wheel has none.
PAGE = HERE.parents[2] / "docs" / "reference" / "python.md"
#: Headings, each with its modules.
FULL = {
    "Graphs, solves and the smoother": ["_native.pyi", "__init__.py", "batched.py"],
    "Factors written in Python": ["traced.py", "formula.py"],
    "Runs and experiments": ["report.py", "frames.py", "logs.py"],
}
#: Modules that a user imports by name.
MODULES = {"manifactor.errors": "errors.py", "manifactor.ray": "ray.py"}
#: Generated modules, with one line for each constructor.
BRIEF = {
    "Variables": "variables.py",
    "Factors": "factors.py",
    "Losses": "losses.py",
    "Solvers": "solvers.py",
    "Starts": "starts.py",
    "Functions of formulas": "functions.py",
}
HEAD = """# Python API

`python -m manifactor._generate` writes this page. [Python](../python.md) is the guide, and [config](config.md) has the fields of every factor.
"""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def public(body: list[ast.stmt]) -> list[ast.stmt]:
    """Returns the public functions and classes of a module or a class, and constructors."""
    named = [s for s in body if isinstance(s, (ast.FunctionDef, ast.ClassDef))]
    return [s for s in named if not s.name.startswith("_") or s.name in ("__init__", "__new__")]


def is_property(function: Function) -> bool:
    return any(isinstance(d, ast.Name) and d.id == "property" for d in function.decorator_list)


def arguments_of(function: Function, method: bool) -> str:
    """Returns the arguments with their types and defaults, without `self` or `cls`."""
    text = ast.unparse(function.args)
    return text.partition(",")[2].strip() if method and "," in text else "" if method else text


def signature(function: Function, owner: str = "") -> str:
    result = f" -> {ast.unparse(function.returns)}" if function.returns else ""
    if function.name in ("__init__", "__new__"):
        return f"{owner}({arguments_of(function, True)})"
    if is_property(function):
        return f"{function.name}{result.replace(' -> ', ': ')}"
    return f"{function.name}({arguments_of(function, bool(owner))}){result}"


def about(node: ast.AST) -> str:
    assert isinstance(node, (ast.FunctionDef, ast.ClassDef))
    return inspect.cleandoc(ast.get_docstring(node) or "")


def paragraph(node: ast.AST) -> str:
    """Returns the first paragraph of a docstring on one line."""
    return " ".join(about(node).split("\n\n")[0].split())


def entries(statement: ast.stmt) -> list[str]:
    """Returns the lines for a function, or for a class and its methods."""
    if isinstance(statement, ast.FunctionDef):
        return [f"### {statement.name}", "", "```python", signature(statement), "```", "", about(statement), ""]
    assert isinstance(statement, ast.ClassDef)
    lines = [f"### {statement.name}", "", about(statement), ""]
    for method in public(statement.body):
        if isinstance(method, ast.FunctionDef):
            text = paragraph(method)
            lines.append(f"- `{signature(method, statement.name)}`" + (f": {text}" if text else ""))
    return [*lines, ""]


def statements(module: str) -> list[ast.stmt]:
    return public(ast.parse((HERE / module).read_text(encoding="utf-8")).body)


def exported(module: str) -> set[str]:
    """Returns the names of a module that the package exports."""
    package = ast.parse((HERE / "__init__.py").read_text(encoding="utf-8")).body
    if module == "__init__.py":
        return {s.name for s in public(package) if isinstance(s, ast.FunctionDef)}
    lists = [s.value for s in package if isinstance(s, ast.Assign) and ast.unparse(s.targets[0]) == "__all__"]
    imports = [s for s in package if isinstance(s, ast.ImportFrom) and s.module == module.partition(".")[0]]
    return {name.name for s in imports for name in s.names} & {n for names in lists for n in ast.literal_eval(names)}


def page() -> str:
    """Returns the text of docs/reference/python.md."""
    lines = [HEAD]
    for heading, modules in FULL.items():
        lines += [f"## {heading}", ""]
        for module in modules:
            names = exported(module)
            chosen = [s for s in statements(module) if getattr(s, "name", "") in names]
            lines += [line for statement in chosen for line in entries(statement)]
    for heading, module in MODULES.items():
        lines += [f"## {heading}", ""]
        lines += [line for statement in statements(module) for line in entries(statement)]
    for heading, module in BRIEF.items():
        lines += [f"## {heading}", ""]
        for statement in statements(module):
            assert isinstance(statement, (ast.FunctionDef, ast.ClassDef))
            lines.append(f"- `{statement.name}`: {paragraph(statement)}")
        lines.append("")
    text = "\n".join(lines).rstrip() + "\n"
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text
