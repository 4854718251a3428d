"""The notebook with the whole story, executed on the emulated board."""

import os
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[1] / "notebooks/story.ipynb"
#: One cell measures for five minutes of the board's time, another calibrates for six (s, on a machine with other work).
LONGEST_CELL = 1800


@pytest.mark.skipif("MIRROR_FULL" not in os.environ, reason="it takes minutes: `cargo xtask python --full`")
def test_the_story_is_told_again_as_it_is_kept() -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    kept = nbformat.read(NOTEBOOK, as_version=4)
    again = nbformat.from_dict(kept)
    # The notebook's own assertions say that the effect is named, and that the error falls.
    nbclient.NotebookClient(again, timeout=LONGEST_CELL, resources={"metadata": {"path": NOTEBOOK.parent}}).execute()

    def shown(notebook: object) -> list[list[str]]:
        cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
        said = [[output for output in cell.outputs if output.get("name") != "stderr"] for cell in cells]
        return [[output.output_type for output in outputs] for outputs in said]

    # Numbers differ in their last digits: the tick at which a command arrives is the host's.
    assert shown(again) == shown(kept)
