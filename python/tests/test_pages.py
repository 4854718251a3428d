"""The code of the package's pages, as it stands there, on emulated boards."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import electrothermal_mirror
import pytest
from electrothermal_mirror import Mirror

SOURCES = Path(__file__).parents[2]


def blocks(page: str) -> list[str]:
    found = re.findall(r"^```python\n(.*?)^```$", (SOURCES / page).read_text(), re.MULTILINE | re.DOTALL)
    assert found, f"{page} shows no code"
    return found


@pytest.mark.parametrize("page", ["python/README.md", "docs/guide/python.md"])
def test_what_a_page_shows_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # On an emulated board in the place of a real one.
    emulated: Callable[[], Mirror] = Mirror.emulated
    monkeypatch.setattr(electrothermal_mirror.Mirror, "start", emulated)
    for data in ("hidden/03", "paper"):
        shutil.copytree(SOURCES / "data" / data, tmp_path / "data" / data)
    monkeypatch.chdir(tmp_path)
    for block in blocks(page):
        # The plan over two boards is told in part: what it needs is tested with four.
        if "off_after_failure" not in block:
            exec(block, {})
