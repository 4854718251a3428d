"""The mirror in pymeasure: ``ElectrothermalMirror("TCPIP::127.0.0.1::5025::SOCKET")``, beside ``host-tool serve``."""

from __future__ import annotations

from typing import Any

from pymeasure.adapters import Adapter
from pymeasure.instruments import Instrument, SCPIMixin
from pymeasure.instruments.validators import strict_range

#: What its driver is called in lists of instruments.
NAME = "Electrothermal mirror"


class ElectrothermalMirror(SCPIMixin, Instrument):  # type: ignore[misc]
    """A mirror by its SCPI commands. The outputs are off once its connection ends."""

    def __init__(self, adapter: Adapter | str, name: str = NAME, **arguments: Any) -> None:
        """Opens the VISA resource ``adapter``, or uses an adapter that is open."""
        # A line ends with a line feed; a mirror may take long to settle.
        socket = {"read_termination": "\n", "write_termination": "\n", "timeout": 30_000}
        super().__init__(adapter, name, tcpip=socket, **arguments)

    range = Instrument.measurement("POS:MAX?", "Get the top of the calibrated range (m).")
    position = Instrument.control(
        "POS?",
        "POS %.9g;*WAI",
        "Control the position (m), from rest and towards the substrate; setting it waits until the mirror has settled.",
        validator=strict_range,
        values=(0.0, 1e-3),
        check_set_errors=True,
    )
    sensor = Instrument.measurement("MEAS:POS?", "Measure the position by the board's sensor (m).")
    drives = Instrument.measurement("MEAS:VOLT?", "Measure what is driven (V).")
    currents = Instrument.measurement("MEAS:CURR?", "Measure the currents (A).")
    resistances = Instrument.measurement("MEAS:RES?", "Measure the heaters' resistances (ohm).")
    temperatures = Instrument.measurement("MEAS:TEMP?", "Measure the heaters' temperatures above ambient (K).")

    def shutdown(self) -> None:
        """Turns the outputs off, and ends the connection."""
        self.write("OUTP OFF")
        super().shutdown()
        self.adapter.close()
