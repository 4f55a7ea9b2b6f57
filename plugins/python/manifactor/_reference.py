"""The reference page of the package, docs/reference/python.md: signatures and docstrings, read from the sources."""

from __future__ import annotations

import ast
import copy
import inspect
from pathlib import Path

HERE = Path(__file__).parent
#: The page in a checkout. A wheel has none.
PAGE = HERE.parents[2] / "docs" / "reference" / "python.md"
#: Headings, each with its modules.
FULL = {
    "Graphs, solves and the smoother": ["_native.pyi", "__init__.py", "batched.py"],
    "Values and factors": ["chosen.py", "groups.py", "algebra.py"],
    "Factors written in Python": ["traced.py", "formula.py"],
    "Runs and experiments": ["report.py", "frames.py", "logs.py"],
}
#: Modules that a user imports by name.
MODULES = {"manifactor.detections": "detections.py", "manifactor.errors": "errors.py", "manifactor.ray": "ray.py"}
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


def is_overload(statement: ast.FunctionDef | ast.ClassDef) -> bool:
    return any(ast.unparse(decorator) == "overload" for decorator in statement.decorator_list)


def public(body: list[ast.stmt]) -> list[ast.FunctionDef | ast.ClassDef]:
    """Returns the public functions and classes of a module or a class, and constructors."""
    named = [s for s in body if isinstance(s, (ast.FunctionDef, ast.ClassDef)) and not is_overload(s)]
    return [s for s in named if not s.name.startswith("_") or s.name in ("__init__", "__new__")]


def signature(function: ast.FunctionDef, owner: str = "") -> str:
    """Returns the name, the arguments without `self` or `cls`, and the result. `owner` is the class of a method."""
    decorators = {ast.unparse(decorator) for decorator in function.decorator_list}
    arguments = copy.deepcopy(function.args)
    if owner and "staticmethod" not in decorators:
        del (arguments.posonlyargs or arguments.args)[0]
    result = ast.unparse(function.returns) if function.returns else ""
    if function.name in ("__init__", "__new__"):
        return f"{owner}({ast.unparse(arguments)})"
    if "property" in decorators:
        return f"{function.name}: {result}"
    name = f"{owner}.{function.name}" if "staticmethod" in decorators else function.name
    return f"{name}({ast.unparse(arguments)})" + (f" -> {result}" if result else "")


def about(node: ast.FunctionDef | ast.ClassDef) -> str:
    """Returns the docstring without indentation."""
    return inspect.cleandoc(ast.get_docstring(node) or "")


def paragraph(node: ast.FunctionDef | ast.ClassDef) -> str:
    """Returns the first paragraph of a docstring on one line."""
    return " ".join(about(node).split("\n\n")[0].split())


def entries(statement: ast.FunctionDef | ast.ClassDef) -> list[str]:
    """Returns the lines for a function, or for a class and its methods."""
    if isinstance(statement, ast.FunctionDef):
        return [f"### {statement.name}", "", "```python", signature(statement), "```", "", about(statement), ""]
    lines = [f"### {statement.name}", "", about(statement), ""]
    for method in public(statement.body):
        if isinstance(method, ast.FunctionDef):
            text = paragraph(method)
            lines.append(f"- `{signature(method, statement.name)}`" + (f": {text}" if text else ""))
    return [*lines, ""]


def statements(module: str) -> list[ast.FunctionDef | ast.ClassDef]:
    """Returns the public functions and classes of a module of the package."""
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
            chosen = [s for s in statements(module) if s.name in names]
            lines += [line for statement in chosen for line in entries(statement)]
    for heading, module in MODULES.items():
        lines += [f"## {heading}", ""]
        lines += [line for statement in statements(module) for line in entries(statement)]
    for heading, module in BRIEF.items():
        lines += [f"## {heading}", ""]
        for statement in statements(module):
            lines.append(f"- `{statement.name}`: {paragraph(statement)}")
        lines.append("")
    text = "\n".join(lines).rstrip() + "\n"
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text
