"""Model and measurements, by the real tool."""

import os
from pathlib import Path

import pytest
from electrothermal_mirror import Model, ToolError, compare, diagnose, fit, session

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


def test_a_session_is_a_frame_in_si_units(tmp_path: Path) -> None:
    frame = session(DATA / "hidden/01")
    assert frame.index.names == ["file", "t_s"]
    sweep = str(DATA / "hidden/01/sweep.csv")
    # Of the second row: 0.25 V, 1.3014 um.
    row = frame.loc[(sweep, 2.0)]
    assert row["V1_V"] == 0.25 and row["z_m"] == pytest.approx(1.3014e-6)
    assert frame.attrs["keys"][sweep]["experiment"] == "sweep"
    assert len(frame.attrs["keys"]) == len(list((DATA / "hidden/01").glob("*.csv")))

    cut = tmp_path / "cut.csv"
    cut.write_text("# ends_with=rows\nt_s,V_V,tilt_x_deg\n1,0,180\n2,0.5")
    with pytest.warns(UserWarning, match="cut short"):
        short = session(tmp_path)
    assert len(short) == 1 and short["tilt_x_rad"].iloc[0] == pytest.approx(3.14159265)
    cut.write_text("no table")
    with pytest.raises(ValueError, match="no measurement file"):
        session(cut)
    with pytest.raises(ValueError, match="no .csv file"):
        session()


def test_a_fitted_model_is_a_value_and_its_file_is_kept_where_that_is_asked(tmp_path: Path) -> None:
    kept = tmp_path / "fitted.toml"
    fitted = fit("paper", DATA / "hidden/01", output=kept)
    assert fitted == Model.load(kept)
    heat = fitted.parameters["R_T"]
    assert heat.unit == "K/W" and heat.standard_error is not None and 0 < heat.standard_error < 0.01 * heat.value and len(heat.actuators) == 4
    assert fitted.preset == "paper" and fitted.effects == () and fitted.provenance["residual_rms_um"] > 0
    assert "R_T" in fitted._repr_html_()
    with pytest.raises(ToolError, match="already exists"):
        fit("paper", DATA / "hidden/01", output=kept)
    kept.write_text("format = 1")
    with pytest.raises(ValueError, match="no model file"):
        Model.load(kept)


def test_what_the_tool_says_is_raised(tmp_path: Path) -> None:
    with pytest.raises(ToolError, match="missing"):
        compare("paper", tmp_path / "missing.csv")


def test_a_tool_that_is_not_there_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(os.environ, "MIRROR_HOST_TOOL", raising=False)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ToolError, match="cargo install"):
        compare("paper")
