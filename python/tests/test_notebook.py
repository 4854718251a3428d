"""Notebooks: the one with the whole story, executed on the emulated board, and one whose kernel is killed while it reads."""

import os
import time
from pathlib import Path

import nbclient
import nbformat
import pytest
from electrothermal_mirror import Mirror, Server
from jupyter_client.manager import start_new_kernel

NOTEBOOK = Path(__file__).parents[1] / "notebooks/story.ipynb"
#: One cell measures for five minutes of the board's time, another calibrates for six (s, on a machine with other work).
LONGEST_CELL = 1800
#: For what comes within a second on an idle machine (s).
PATIENCE = 90


@pytest.mark.skipif("MIRROR_FULL" not in os.environ, reason="it takes minutes: `cargo xtask python --full`")
def test_the_story_is_told_again_as_it_is_kept() -> None:
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


def test_a_kernel_that_is_killed_in_mid_stream_leaves_nothing_driven(mirror: Mirror, served: Server) -> None:
    manager, client = start_new_kernel(env=os.environ.copy())
    try:
        host, port = served.address
        program = f"from electrothermal_mirror import Mirror; mirror = Mirror({host!r}, {port}); mirror.drive(2.0)"
        client.execute_interactive(program, timeout=PATIENCE)
        client.execute("while True: mirror.trace(1000, 1e-3)")
        begun = time.monotonic()
        while client.get_iopub_msg(timeout=PATIENCE)["content"].get("execution_state") != "busy":
            assert time.monotonic() - begun < PATIENCE
        assert mirror.is_driven
        manager.signal_kernel(9)
        killed = time.monotonic()
        while mirror.is_driven:
            assert time.monotonic() - killed < PATIENCE, "it is driven on"
        print(f"\noff {time.monotonic() - killed:.3f} s after the kernel was killed")
        # Who drove is gone, and another may.
        mirror.move(30e-6)
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
