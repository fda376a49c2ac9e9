"""The notebooks run from their first cell to their last, in a kernel and an empty folder, as a user
runs them."""

import os
import sys

import nbformat
import pytest
from nbclient import NotebookClient

from ..support.rooms import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
SLOW = ("twin",)
RUN = [pytest.param(p, marks=[pytest.mark.slow] * (p.stem in SLOW), id=p.stem) for p in NOTEBOOKS]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the kernel's own client
@pytest.mark.parametrize("path", RUN)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    kernels = tmp_path / "kernels"
    monkeypatch.setenv(
        "JUPYTER_PATH", os.pathsep.join([str(kernels), sys.prefix + "/share/jupyter"])
    )
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    notebook = nbformat.read(path, as_version=4)
    folder = tmp_path / "empty"
    folder.mkdir()
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": folder}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    shown = [kind for output in outputs for kind in output.get("data", ())]
    assert not [output for output in outputs if output.output_type == "error"]
    assert "image/png" in shown  # the plot
    if path.stem == "place":
        assert "text/html" in shown  # a result with its picture
        assert (folder / "proposal.toml").is_file()


def test_notebooks_are_stored_without_outputs():
    assert NOTEBOOKS
    for path in NOTEBOOKS:
        for cell in nbformat.read(path, as_version=4).cells:
            assert not cell.get("outputs")
            assert cell.get("execution_count") is None
