"""Model and measurements, by the real tool."""

import os
from pathlib import Path

import pytest
from electrothermal_mirror import ToolError, compare, diagnose

DATA = Path(__file__).parents[2] / "data"


def test_a_comparison_is_a_value_with_its_sentences() -> None:
    found = compare("paper", DATA / "paper/published.csv")
    assert found.unit == "um" and found.rms > 0
    assert found.experiments[0].experiment == "sweep"
    assert abs(found.experiments[0].largest) >= found.rms
    assert "farthest off in sweep" in found.sentences[0]
    assert "<table>" in found._repr_html_()


def test_a_diagnosis_is_a_value() -> None:
    found = diagnose("paper", DATA / "paper/inferred.csv")
    assert found.verdict == "none" and found.effects == ()
    assert found.ranking[0].score >= found.ranking[-1].score
    assert "no effect" in found._repr_html_()


def test_what_the_tool_says_is_raised(tmp_path: Path) -> None:
    with pytest.raises(ToolError, match="missing"):
        compare("paper", tmp_path / "missing.csv")


def test_a_tool_that_is_not_there_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(os.environ, "MIRROR_HOST_TOOL", raising=False)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ToolError, match="cargo install"):
        compare("paper")
