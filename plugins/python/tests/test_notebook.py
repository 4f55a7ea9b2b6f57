"""The notebook of the examples runs from top to bottom, and is stored without output."""

from __future__ import annotations

from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[3] / "examples" / "python" / "first_steps.ipynb"


def test_the_notebook_runs() -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells), "clear all outputs before it is kept"
    client = nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(NOTEBOOK.parent)}})
    client.execute()
    assert all(output.output_type != "error" for cell in cells for output in cell.outputs)
    # the solution as a table, the report as its page with the map
    assert any("text/html" in output.get("data", {}) for output in cells[1].outputs)
    assert "<iframe" in cells[-1].outputs[0].data["text/html"]
