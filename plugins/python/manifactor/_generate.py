"""Writes the modules with a constructor for each entry of the catalogue: `python -m manifactor._generate`.

A test checks that the files match the catalogue.
"""

from __future__ import annotations

import json
import keyword
import re
import textwrap
import tomllib
from pathlib import Path
from typing import Any

from . import _native, _reference

KINDS = ("factor", "loss", "solver", "start")
CLASSES = {"factor": "Factor", "loss": "Loss", "solver": "Solver", "start": "Start", "variable": "Variable"}
HEADER = '"""{about}\n\nWritten by `python -m manifactor._generate` from the catalogue."""\n\nfrom __future__ import annotations\n'
WIDTH = 110
#: Base classes of the groups in space.
SPATIAL = {"so3": "SpatialRotation", "se3": "SpatialPose"}
GROUPS = ("Group", *SPATIAL.values())

Schema = dict[str, Any]


def camel(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def safe(name: str) -> str:
    return name + "_" if keyword.iskeyword(name) else name


class Types:
    """Type hints for schemas; nested tables become `TypedDict`s of the module `types`."""

    def __init__(self) -> None:
        self.tables: dict[str, tuple[Schema, Schema]] = {}
        #: Names of types that the current module uses.
        self.used: set[str] = set()

    def hint(self, schema: Schema, definitions: Schema, owner: str, within: bool = False) -> str:
        """The type hint of a field. With `within`, the hint is for the module `types`, whose names need no
        prefix."""
        schema = {key: value for key, value in schema.items() if key not in ("description", "default")}
        if "$ref" in schema:
            name = schema["$ref"].removeprefix("#/$defs/")
            if name in CLASSES:
                self.used.add(CLASSES[name])
                return CLASSES[name]
            definition = definitions.get(name, {})
            if definition.get("type") == "object" and "properties" in definition:
                if name == "Noise":
                    self.used.add("Noise")
                    return "Noise"
                return self.table(name, definition, definitions, owner, within)
            return self.hint(definition, definitions, owner, within)
        if "const" in schema:
            return f"Literal[{schema['const']!r}]"
        for of in ("anyOf", "oneOf"):
            if of in schema:
                return self.union(schema[of], definitions, owner, within)
        match schema.get("type"):
            case [of, "null"]:
                # an optional field, whose parameter accepts None in any case
                return self.hint({**schema, "type": of}, definitions, owner, within)
            case "number":
                return "Number"
            case "integer":
                return "int"
            case "boolean":
                return "bool"
            case "string":
                return "str"
            case "null":
                return "None"
            case "array":
                return self.array(schema, definitions, owner, within)
            case "object" if "properties" not in schema:
                return "Fields"
            case _:
                return "Any"

    def array(self, schema: Schema, definitions: Schema, owner: str, within: bool) -> str:
        item = self.hint(schema.get("items", {}), definitions, owner, within)
        return {"Number": "Numbers", "int": "Numbers", "Numbers": "Rows"}.get(item, f"Sequence[{item}]")

    def union(self, schemas: list[Schema], definitions: Schema, owner: str, within: bool) -> str:
        hints: list[str] = []
        for schema in schemas:
            hint = self.hint(schema, definitions, owner, within)
            if hint not in hints:
                hints.append(hint)
        literals = [hint.removeprefix("Literal[").removesuffix("]") for hint in hints if hint.startswith("Literal[")]
        rest = [hint for hint in hints if not hint.startswith("Literal[")]
        return " | ".join(([f"Literal[{', '.join(literals)}]"] if literals else []) + rest)

    def table(self, name: str, schema: Schema, definitions: Schema, owner: str, within: bool) -> str:
        known = self.tables.get(name)
        if known is not None and known[0] != schema:
            name = camel(owner) + name
        if name not in self.tables:
            self.tables[name] = (schema, definitions)
            # nested tables become types too
            for field in schema["properties"].values():
                self.hint(field, definitions, owner, True)
        return name if within else f"types.{name}"


def docstring(text: str, indent: str) -> str:
    text = text.replace("\\", "\\\\").replace('"""', "'''")
    lines = ('"""' + text.strip() + ("\n" if "\n" in text.strip() else "") + '"""').splitlines()
    return "\n".join((indent + line).rstrip() for line in lines)


def one_line(text: str) -> str:
    return " ".join(text.split())


def explained(entry: Schema) -> str:
    """The docs of an entry, and the descriptions of its fields."""
    parts = [entry["docs"]]
    fields = entry["schema"].get("properties", {})
    if fields:
        lines = ["Args:"]
        for name, field in fields.items():
            about = one_line(field.get("description", ""))
            if "default" in field and "Default" not in about:
                about += f" Default: {json.dumps(field['default'])}."
            lines += textwrap.wrap(f"{safe(name)}: {about}", WIDTH - 8, initial_indent="    ", subsequent_indent="        ")
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def parameters(entry: Schema, types: Types, variables: dict[str, Schema]) -> list[tuple[str, str, str, bool]]:
    """Name, hint, expression and required flag of each field."""
    schema = entry["schema"]
    definitions = schema.get("$defs", {})
    required = schema.get("required", [])
    listed = []
    for name, field in schema.get("properties", {}).items():
        value = safe(name)
        reference = field.get("$ref", "").removeprefix("#/$defs/")
        owners = [v for v in variables.values() if v["schema"].get("title") == reference]
        own = [v for v in owners if v["name"] in entry["variables"]] or owners
        if reference and own:
            hint = f"variables.{camel(own[0]['name'])} | Fields"
            value = f"untagged({value})"
        else:
            hint = types.hint(field, definitions, entry["name"])
        is_there = name in required
        if not is_there and "None" not in hint.split(" | "):
            hint += " | None"
        listed.append((name, hint, value, is_there))
    return sorted(listed, key=lambda one: not one[3])


def signature(head: str, fields: list[tuple[str, str, str, bool]], result: str) -> str:
    arguments = [f"{safe(name)}: {hint}" + ("" if needed else " = None") for name, hint, _, needed in fields]
    head += ", *, " if fields and head.endswith("cls") else "*, " if fields else ""
    line = f"{head}{', '.join(arguments)}) -> {result}:"
    if len(line) <= WIDTH:
        return line
    indent = " " * (len(head) - len(head.lstrip()))
    first, _, _ = head.partition("(")
    before = ["cls"] if "(cls" in head else []
    inner = "".join(f"{indent}    {argument},\n" for argument in [*before, "*", *arguments])
    return f"{first}(\n{inner}{indent}) -> {result}:"


def fields_of(fields: list[tuple[str, str, str, bool]]) -> str:
    return "{" + ", ".join(f'"{name}": {value}' for name, _, value, _ in fields) + "}"


def imports(body: str, kind: str, used: set[str]) -> str:
    lines = []
    standard = []
    if "Sequence[" in body:
        standard.append("from collections.abc import Sequence")
    typing = [name for name in ("Any", "ClassVar", "Literal", "TypedDict") if f"{name}[" in body or f": {name}" in body or f"({name}" in body or f" {name}" in body]
    if typing:
        standard.append(f"from typing import {', '.join(typing)}")
    if standard:
        lines.append("\n".join(standard))
    local = []
    modules = [name for name in ("types", "variables") if f"{name}." in body]
    if modules:
        local.append(f"from . import {', '.join(modules)}")
    names = {CLASSES.get(kind, "")} | used
    names |= {name for name in ("Fields", "Number", "Numbers", "Rows", "untagged") if re.search(rf"\b{name}\b", body)}
    native = sorted(names & {"Noise", "untagged"})
    if native:
        local.append(f"from ._native import {', '.join(native)}")
    names -= {"", *native}
    if names:
        local.append(f"from .chosen import {', '.join(sorted(names))}")
    lines.append("\n".join(local))
    return "\n".join(f"\n{line}" for line in lines if line) + "\n"


def module(kind: str, entries: list[Schema], types: Types, variables: dict[str, Schema]) -> str:
    types.used = set()
    parts = []
    for entry in entries:
        fields = parameters(entry, types, variables)
        head = signature(f"def {safe(entry['name'])}(", fields, CLASSES[kind])
        doc = docstring(explained(entry), "    ")
        call = f'    return {CLASSES[kind]}("{entry["name"]}", {fields_of(fields)})'
        parts.append(f"{head}\n{doc}\n{call}")
    names = [safe(entry["name"]) for entry in entries]
    body = "\n\n\n".join(parts)
    listed = "\n\n__all__ = [\n" + "".join(f'    "{name}",\n' for name in names) + "]\n"
    about = f"Every {kind} that is linked, as a function of its fields."
    return HEADER.format(about=about) + imports(body, kind, types.used) + listed + "\n\n" + body + "\n"


def base_of(entry: Schema, functions: list[Schema]) -> str:
    """The base class of a type of variables."""
    if entry["name"] in SPATIAL:
        return SPATIAL[entry["name"]]
    quantity = entry["quantity"] or ""
    if any(f["name"] == "inverse" and f["arguments"][0][1] == quantity for f in functions):
        return "Group"
    return "Vector" if quantity.startswith("vector") else "Variable"


def places_of(entry: Schema) -> str:
    """The place of each field among the numbers of a value, found by comparison at a point without equal
    numbers."""
    if not entry["quantity"]:
        return "{}"
    example = tomllib.loads(entry["docs"].partition("```toml")[2].partition("```")[0])["values"]
    fields = next(iter(example.values()))
    value = _native.Chosen("variable", fields.pop("type"), fields)
    value = _native.retract(value, [0.1 / (i + 1.7) for i in range(len(entry["tangent"]))])
    numbers = list(_native.ValueArray([value]).numbers()[0])
    places = []
    for name, field in value.to_dict().items():
        if isinstance(field, float):
            places.append(f'"{name}": {numbers.index(field)}')
        elif isinstance(field, list):
            first = next(i for i in range(len(numbers)) if numbers[i : i + len(field)] == field)
            places.append(f'"{name}": slice({first}, {first + len(field)})')
    return "{" + ", ".join(places) + "}"


def methods_of(entry: Schema, base: str, own: set[str], functions: list[Schema], groups: dict[str, str]) -> list[str]:
    """Functions of formulas, as properties if they have one argument and as methods otherwise."""
    taken = set(own) | {"sum", "where", "vector"}
    if base in GROUPS:
        taken |= {"inverse", "log", "between"}
    lines: list[str] = []
    for function in functions:
        name, arguments = function["name"], function["arguments"]
        if not name.isidentifier() or name in taken or not arguments or arguments[0][1] != entry["quantity"]:
            continue
        if keyword.iskeyword(name):
            continue
        taken.add(name)
        result = groups.get(function["result"], "Any")
        rest = [safe(argument) for argument, _ in arguments[1:]]
        about = docstring(one_line(function["summary"]), "        ")
        lines += ["", *([] if rest else ["    @property"])]
        lines += [f"    def {name}({', '.join(['self', *(f'{argument}: Any' for argument in rest)])}) -> {result}:", about]
        ignored = "" if result == "Any" else "  # type: ignore[no-any-return]"
        lines += [f"        return computed({', '.join(['self', json.dumps(name), *rest])}){ignored}"]
    return lines


def module_of_variables(entries: list[Schema], functions: list[Schema], types: Types) -> str:
    types.used = set()
    parts = []
    bases = {entry["name"]: base_of(entry, functions) for entry in entries}
    groups = {name: camel(name) for name, base in bases.items() if base in GROUPS}
    for entry in entries:
        fields = parameters(entry, types, {})
        name, base = camel(entry["name"]), bases[entry["name"]]
        tangent = ", ".join(f'"{direction}"' for direction in entry["tangent"])
        tangent = f"({tangent},)" if len(entry["tangent"]) == 1 else f"({tangent})"
        lines = [
            f"class {name}({base}):",
            docstring(explained(entry), "    "),
            "",
            f'    TYPE: ClassVar[str] = "{entry["name"]}"',
            f'    SHAPE: ClassVar[str] = "{entry["quantity"] or ""}"',
            f"    TANGENT: ClassVar[tuple[str, ...]] = {tangent}",
            f"    FIELDS: ClassVar[Mapping[str, int | slice]] = {places_of(entry)}",
            "",
            signature("    def __new__(cls", fields, "Self"),
            f'        return super().__new__(cls, "variable", "{entry["name"]}", {fields_of(fields)})',
        ]
        for field, hint, _, _ in fields:
            what = "float" if hint == "Number" else "NDArray[np.float64]"
            about = one_line(entry["schema"]["properties"][field].get("description", ""))
            lines += ["", "    @property", f"    def {safe(field)}(self) -> {what}:", f'        """{about}"""']
            lines += [f'        return self.__getattr__("{field}")  # type: ignore[no-any-return]']
        lines += methods_of(entry, base, {field for field, *_ in fields}, functions, groups)
        parts.append("\n".join(lines))
    body = "\n\n\n".join(parts)
    named = "\n\n\n#: The class of each type of variables, by its name in documents.\nBY_TYPE: dict[str, type[Variable]] = {\n"
    named += "".join(f'    "{entry["name"]}": {camel(entry["name"])},\n' for entry in entries) + "}\n"
    head = HEADER.format(about="Every type of variables that is linked, as a class of its values.")
    head += "\nfrom collections.abc import Mapping\nfrom typing import Any, ClassVar, Self\n"
    head += "\nimport numpy as np\nfrom numpy.typing import NDArray\n"
    head += "\nfrom .chosen import Number, Numbers, Variable, computed\nfrom .groups import Group, SpatialPose, SpatialRotation, Vector\n"
    head += "\n__all__ = [\n" + "".join(f'    "{camel(entry["name"])}",\n' for entry in entries) + "]\n"
    return head + "\n\n" + body + named


def module_of_types(types: Types) -> str:
    parts = []
    for name, (schema, definitions) in types.tables.items():
        required = schema.get("required", [])
        lines = [f"class {name}(TypedDict, total=False):"]
        about = one_line(schema.get("description", name).split("\n\n")[0])
        lines += textwrap.wrap(f'"""{about}"""', WIDTH, initial_indent="    ", subsequent_indent="    ")
        lines.append("")
        for field, of in schema["properties"].items():
            hint = types.hint(of, definitions, name, True)
            description = one_line(of.get("description", ""))
            lines += textwrap.wrap(f"{description}", WIDTH, initial_indent="    #: ", subsequent_indent="    #: ")
            lines.append(f"    {field}: " + (f"Required[{hint}]" if field in required else hint))
        parts.append("\n".join(lines))
    body = "\n\n\n".join(parts)
    sequences = "\nfrom collections.abc import Sequence\n" if "Sequence[" in body else ""
    typing = [name for name in ("Any", "Literal", "Required") if f"{name}[" in body or f": {name}" in body or f"| {name}" in body]
    head = HEADER.format(about="Tables of fields within factors, losses and solvers.")
    head += (sequences or "\n") + f"from typing import {', '.join([*typing, 'TypedDict'])}\n"
    if "Noise" in body:
        head += "\nfrom ._native import Noise"
    names = [n for n in ("Factor", "Fields", "Loss", "Number", "Numbers", "Rows", "Solver", "Variable") if re.search(rf"(: |\W){n}\b(?! of)", body)]
    return head + f"\nfrom .chosen import {', '.join(names)}\n\n\n" + body + "\n"


def module_of_functions(functions: list[Schema]) -> str:
    names: dict[str, list[Schema]] = {}
    for function in functions:
        if function["name"].isidentifier():
            names.setdefault(function["name"], []).append(function)
    parts = []
    for name, overloads in names.items():
        lines = []
        for function in overloads:
            arguments = ", ".join(f"{argument}: {shape}" for argument, shape in function["arguments"])
            lines.append(f"{name}({arguments}) -> {function['result']}: {one_line(function['summary'])}")
        arities = sorted({len(function["arguments"]) for function in overloads})
        if arities == [1]:
            taken, given = "a: Any, /", "a"
        elif arities == [2]:
            taken, given = "a: Any, b: Any, /", "a, b"
        elif arities == [3]:
            taken, given = "a: Any, b: Any, c: Any, /", "a, b, c"
        else:
            taken, given = "*arguments: Any", "*arguments"
        doc = docstring("\n\n".join(lines), "    ")
        parts.append(f'def {safe(name)}({taken}) -> Any:\n{doc}\n    return call("{name}", {given})')
    head = HEADER.format(about="Functions of formulas, for factors that are written in Python.")
    return head + "\nfrom typing import Any\n\nfrom .formula import call\n\n\n" + "\n\n\n".join(parts) + "\n"


def whole(schema: Schema) -> Schema:
    """Resolves a schema that is only a reference to another type, and adds that type's fields."""
    name = schema.get("$ref", "").removeprefix("#/$defs/")
    return {**schema["$defs"][name], **{key: value for key, value in schema.items() if key != "$ref"}} if name else schema


def modules() -> dict[str, str]:
    """The text of each module by name."""
    entries: list[Schema] = json.loads(_native.catalogue())
    for entry in entries:
        entry["schema"] = whole(entry["schema"])
    functions: list[Schema] = json.loads(_native.functions())
    types = Types()
    variables = {entry["name"]: entry for entry in entries if entry["kind"] == "variable"}
    texts = {}
    for kind in KINDS:
        chosen = [entry for entry in entries if entry["kind"] == kind]
        texts[kind + ("es" if kind == "loss" else "s")] = module(kind, chosen, types, variables)
    texts["variables"] = module_of_variables(list(variables.values()), functions, types)
    texts["types"] = module_of_types(types)
    texts["functions"] = module_of_functions(functions)
    return {name: text.replace("\n\n\n\n", "\n\n\n") for name, text in texts.items()}


def main() -> None:
    for name, text in modules().items():
        (Path(__file__).parent / f"{name}.py").write_text(text, encoding="utf-8")
    if _reference.PAGE.parent.is_dir():
        _reference.PAGE.write_text(_reference.page(), encoding="utf-8")


if __name__ == "__main__":
    main()
