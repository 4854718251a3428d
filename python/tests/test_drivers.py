"""Each driver in its real framework, on the emulated board. One whose framework is not installed is skipped, and says so."""

import asyncio
import math
from pathlib import Path

import pytest
from electrothermal_mirror import EmulatedBoard, InstrumentError, Mirror, Server

#: The bench mirror is off by so much at most until it is calibrated (m; docs/guide/calibrate.md, error at rest, before).
UNCALIBRATED = 10.8e-6


def test_qcodes(served: Server) -> None:
    pytest.importorskip("qcodes")
    from electrothermal_mirror.drivers.qcodes import ElectrothermalMirror

    instrument = ElectrothermalMirror("mirror", Mirror(*served.address))
    try:
        instrument.position(60e-6)
        assert instrument.position() == pytest.approx(60e-6)
        assert instrument.sensor() == pytest.approx(60e-6, abs=UNCALIBRATED)
        assert instrument.currents().shape == (4,)
        assert instrument.get_idn()["vendor"] == "host-tool"
        snapshot = instrument.snapshot(update=True)
        assert snapshot["parameters"]["position"]["unit"] == "m"
        with pytest.raises(ValueError, match="must be between"):
            instrument.position(1.0)
        with Mirror(*served.address) as another:
            another.off()
        with pytest.raises(InstrumentError, match="turned the channels off"):
            instrument.position()
        assert math.isnan(instrument.position())
    finally:
        instrument.close()


def test_pymeasure(served: Server) -> None:
    pytest.importorskip("pymeasure")
    pytest.importorskip("pyvisa_py")
    from electrothermal_mirror.drivers.pymeasure import ElectrothermalMirror

    host, port = served.address
    instrument = ElectrothermalMirror(f"TCPIP::{host}::{port}::SOCKET", visa_library="@py")
    try:
        assert math.isnan(instrument.position)
        for asked in (500e-6, -1e-6, math.nan):
            with pytest.raises(InstrumentError, match="range|number"):
                instrument.position = asked
        instrument.position = 60e-6
        assert instrument.position == pytest.approx(60e-6)
        assert instrument.sensor == pytest.approx(60e-6, abs=UNCALIBRATED)
        assert len(instrument.currents) == 4
        assert instrument.check_errors() == []
        instrument.write("NONSENSE")
        assert instrument.check_errors()[0][0] == -113
        with pytest.raises(InstrumentError, match="NONSENSE"):
            instrument.ask("NONSENSE?")
    finally:
        instrument.shutdown()


def test_ophyd(served: Server) -> None:
    pytest.importorskip("ophyd_async")
    from bluesky import RunEngine
    from bluesky.plans import scan
    from electrothermal_mirror.drivers.ophyd import ElectrothermalMirror

    documents: list[tuple[str, dict]] = []
    with Mirror(*served.address) as mirror:
        device = ElectrothermalMirror(mirror, "mirror")
        engine = RunEngine()
        engine(scan([device], device, 20e-6, 60e-6, 3), lambda name, document: documents.append((name, document)))
    read = [document["data"]["mirror-position"] for name, document in documents if name == "event"]
    assert read == pytest.approx([20e-6, 40e-6, 60e-6], abs=UNCALIBRATED)
    assert documents[-1][1]["exit_status"] == "success"


def test_epics_bears_that_serve_is_started_anew(tmp_path: Path) -> None:
    pytest.importorskip("caproto")
    from electrothermal_mirror.drivers.epics import MirrorRecords

    with EmulatedBoard(boards=tmp_path) as board:
        servers = [Server(board.name, tmp_path)]
        records = MirrorRecords(lambda: Mirror(*servers[-1].address), "TEST:")
        records.mirror.move(60e-6)
        servers[0].close()
        with pytest.raises(OSError):
            records.reader.position()
        # As long as none is there, it is asked for again.
        asyncio.run(records.connect_again())
        with Server(board.name, tmp_path) as server:
            servers.append(server)
            asyncio.run(records.connect_again())
            # The one that ended has turned the mirror off.
            assert not records.reader.is_driven
            records.mirror.move(40e-6)
            assert records.reader.position() == pytest.approx(40e-6, abs=UNCALIBRATED)
