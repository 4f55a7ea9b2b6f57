"""The constructors match the catalogue."""

from __future__ import annotations

import inspect
import json
import tomllib
from pathlib import Path
from typing import Any

import manifactor as mf
import pytest
from manifactor import _generate, _native, _reference

ENTRIES: list[dict[str, Any]] = json.loads(_native.catalogue())
CONSTRUCTED = [entry for entry in ENTRIES if entry["kind"] in ("factor", "loss", "solver", "start", "variable")]


@pytest.mark.parametrize("name", _generate.modules())
def test_what_is_generated_is_what_the_catalogue_says(name: str) -> None:
    written = (Path(_generate.__file__).parent / f"{name}.py").read_text(encoding="utf-8")
    assert written == _generate.modules()[name], "run python -m manifactor._generate"


def test_the_reference_page_matches_the_package() -> None:
    written = (Path(__file__).parents[3] / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    assert written == _reference.page(), "run python -m manifactor._generate"


def constructor(entry: dict[str, Any]) -> Any:
    if entry["kind"] == "variable":
        return mf.variables.BY_TYPE[entry["name"]]
    module = getattr(mf, {"loss": "losses"}.get(entry["kind"], entry["kind"] + "s"))
    return getattr(module, _generate.safe(entry["name"]))


@pytest.mark.parametrize("entry", CONSTRUCTED, ids=lambda entry: f"{entry['kind']} {entry['name']}")
def test_every_entry_is_constructed_from_the_example_of_its_docs(entry: dict[str, Any]) -> None:
    make = constructor(entry)
    assert inspect.getdoc(make)
    example = entry["docs"].split("```toml\n", 1)[1].split("```", 1)[0]
    fields = own(tomllib.loads(example), entry["name"])
    made = make(**{_generate.safe(name): value for name, value in fields.items() if name != "type"})
    again = type(made)(entry["name"], fields) if entry["kind"] != "variable" else make(**{k: v for k, v in fields.items() if k != "type"})
    assert made == again and made.type == entry["name"] and made.kind == entry["kind"]


def own(document: Any, name: str) -> dict[str, Any]:
    """The table of a document that has this type."""
    if isinstance(document, dict):
        if document.get("type") == name:
            return document
        document = list(document.values())
    if isinstance(document, list):
        for item in document:
            found = own(item, name)
            if found:
                return found
    return {}


def test_values_have_their_class() -> None:
    values = mf.Values({"x": mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1])})
    assert type(values["x"]) is mf.Se3 and values["x"].TANGENT == ("rx", "ry", "rz", "x", "y", "z")
    factor = mf.Graph()
    factor.add("x", mf.prior_se3(value=values["x"]))
    assert type(factor[0].factor) is mf.Factor


def test_names_at_the_top_are_told_apart() -> None:
    factors, losses, types = set(mf.factors.__all__), set(mf.losses.__all__), set(mf.variables.BY_TYPE)
    own_names = {"batch", "check_factor", "errors", "experiment", "factor", "load", "run", "save", "solve", "where"}
    assert not factors & losses and not (factors | losses) & own_names and types
    assert mf.__version__ == _native.__version__
