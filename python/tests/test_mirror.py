"""The mirror, with the real tool and firmware on an emulated board."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
from electrothermal_mirror import EmulatedBoard, InstrumentError, Mirror, Server
from electrothermal_mirror.processes import run_tool


def test_moves_waits_and_reads(mirror: Mirror) -> None:
    mirror.move(60e-6)
    assert mirror.is_driven and mirror.channels == ["driving"] * 4
    # So much at most until it is calibrated (docs/guide/calibrate.md, error at rest, before).
    assert mirror.position() == pytest.approx(60e-6, abs=10.8e-6)
    assert mirror.currents().shape == mirror.drives().shape == (4,)
    # Each from a tick of its own. A conversion's noise is 1.2 of 4096 steps, 0.1 % of such currents; ten times that.
    np.testing.assert_allclose(mirror.drives() / mirror.currents(), mirror.resistances(), rtol=0.01)
    assert "µm" in mirror._repr_html_()
    mirror.off()
    assert not mirror.is_driven


def test_a_wait_is_as_long_as_a_client_or_the_board_says(mirror: Mirror) -> None:
    assert np.isnan(mirror.settling), "it is left to the board"
    mirror.move(30e-6)
    # The factory's calibration was never tried on the mirror, so the board foresees nothing.
    assert np.isnan(mirror.settles_in())
    mirror.settling = np.float64(0.2)
    assert mirror.settling == 0.2
    mirror.move(31e-6)


def test_what_the_board_does_not_know_is_no_number(mirror: Mirror) -> None:
    mirror.move(30e-6)
    # The factory says by how much its calibration may be off, and knows neither levers nor the room of a calibration.
    uncertainty = mirror.uncertainty()
    assert 0 < uncertainty.position < 30e-6 and np.isnan(uncertainty.tilt)
    assert np.isnan(mirror.room().rise)
    pose = mirror.pose()
    # It counts in micrometres, as 32-bit floats.
    assert pose.position == pytest.approx(30e-6, abs=1e-11) and np.isnan(pose.tilt_x)
    with pytest.raises(InstrumentError, match="levers"):
        mirror.tilt(30e-6, 1e-3, 0.0)
    mirror.tilt(31e-6, 0.0, 0.0)
    assert mirror.pose().position == pytest.approx(31e-6, abs=1e-11)


def test_a_trace_has_the_times_that_were_asked_for(mirror: Mirror) -> None:
    mirror.drive(1.0)
    trace = mirror.trace(200, 1e-3)
    np.testing.assert_allclose(np.diff(trace.time), 1e-3)
    np.testing.assert_allclose(trace.drives.mean(axis=0), 1.0, atol=1e-3)
    frame = trace.to_pandas()
    assert frame.index.name == "t_s" and list(frame.columns[:2]) == ["V1_V", "V2_V"]
    assert "200 samples" in trace._repr_html_()
    # Between two ticks no sample is taken, so none can have that time.
    with pytest.raises(InstrumentError, match="whole ticks"):
        mirror.trace(5, 0.15e-3)


def test_a_scan_rises_with_what_was_asked(mirror: Mirror) -> None:
    mirror.settling = 0.3
    read = mirror.scan(np.array([20e-6, 60e-6, 100e-6]))
    assert np.all(np.diff(read) > 20e-6)


def test_one_that_is_not_to_drive_is_told_who_does(served: Server, mirror: Mirror) -> None:
    mirror.move(30e-6)
    assert not mirror.is_stopped
    with Mirror(*served.address) as another, pytest.raises(InstrumentError, match="driven by 127.0.0.1"):
        another.lock()
    mirror.lock()


def test_one_that_was_turned_off_beside_it_is_stopped_at_the_first_asking() -> None:
    with EmulatedBoard() as board, Server(board.name, board.boards) as server, Mirror(*server.address) as mirror:
        mirror.drive(1.0, wait=False)
        assert not mirror.is_stopped
        run_tool("off", boards=board.boards)
        # What drives learns it as it goes on.
        start = time.monotonic()
        while not mirror.is_stopped:
            assert time.monotonic() - start < 90, "nobody has told it"
        assert mirror.is_stopped
        assert "host-tool off" in mirror.told_of_stop
        mirror.lock()
        assert not mirror.is_stopped
        mirror.drive(1.0, wait=False)


def test_what_is_out_of_range_is_said(mirror: Mirror) -> None:
    with pytest.raises(InstrumentError, match="beyond the range") as raised:
        mirror.move(1.0)
    assert raised.value.number == -222


def test_one_drives_and_others_read(mirror: Mirror, served: Server) -> None:
    mirror.drive(1.0, wait=False)
    with Mirror(*served.address) as second:
        assert second.is_driven
        with pytest.raises(InstrumentError, match="driven by"):
            second.move(10e-6)


def test_what_a_process_drives_is_off_once_it_is_killed(mirror: Mirror, served: Server) -> None:
    host, port = served.address
    program = (
        "import sys; from electrothermal_mirror import Mirror\n"
        f"mirror = Mirror({host!r}, {port}); mirror.drive(2.0); print('driven', flush=True)\n"
        "while True: mirror.trace(1000, 1e-3)"
    )
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"driven\n"
    assert mirror.is_driven
    process.kill()
    process.wait()
    start = time.monotonic()
    while mirror.is_driven:
        assert time.monotonic() - start < 90, "it is driven on"
    process.stdout.close()


def test_a_process_that_is_killed_leaves_no_tool_behind() -> None:
    program = "import time; from electrothermal_mirror import Server\nprint(Server().process.pid, flush=True); time.sleep(1000)"
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert process.stdout is not None
    tool = int(process.stdout.readline())
    os.kill(tool, 0)
    process.kill()
    process.wait()
    process.stdout.close()
    start = time.monotonic()
    with pytest.raises(ProcessLookupError):
        while time.monotonic() - start < 90:
            os.kill(tool, 0)
            time.sleep(0.01)


def test_every_query_is_answered_and_how_soon_is_printed(mirror: Mirror) -> None:
    mirror.drive(1.0)
    took_ms = np.empty(2000)
    for index in range(took_ms.size):
        start = time.perf_counter()
        currents = mirror.currents()
        took_ms[index] = (time.perf_counter() - start) * 1e3
        assert currents.shape == (4,) and np.isfinite(currents).all()
    # How soon tells who else has the processor: the guide has it, measured on an idle machine.
    print(f"\nround trip of a query: median {np.median(took_ms):.2f} ms, p99 {np.quantile(took_ms, 0.99):.2f} ms")
