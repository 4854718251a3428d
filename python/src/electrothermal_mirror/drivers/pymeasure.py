"""The mirror in pymeasure: ``ElectrothermalMirror("TCPIP::127.0.0.1::5025::SOCKET")``, beside ``host-tool serve``."""

from __future__ import annotations

from typing import Any

from pymeasure.adapters import Adapter
from pymeasure.instruments import Instrument, SCPIMixin

from ..instrument import error_in, known

#: What asks for the oldest error.
NEXT_ERROR = "SYST:ERR?"
#: What its driver is called in lists of instruments.
NAME = "Electrothermal mirror"


class ElectrothermalMirror(SCPIMixin, Instrument):  # type: ignore[misc]
    """A mirror by its SCPI commands. The outputs are off once its connection ends.

    What the instrument refuses raises its sentence, an :class:`~electrothermal_mirror.InstrumentError`, where it was asked. What is
    in range only the instrument knows: it is the calibration's, and in a warm room does not begin at 0.
    """

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
        check_set_errors=True,
    )
    sensor = Instrument.measurement("MEAS:POS?", "Measure the position by the board's sensor (m).")
    drives = Instrument.measurement("MEAS:VOLT?", "Measure what is driven (V).")
    currents = Instrument.measurement("MEAS:CURR?", "Measure the currents (A).")
    resistances = Instrument.measurement("MEAS:RES?", "Measure the heaters' resistances (ohm).")
    temperatures = Instrument.measurement("MEAS:TEMP?", "Measure the heaters' temperatures above ambient (K).")

    def ask(self, command: str, query_delay: float | None = None) -> str:
        """The answer to ``command``.

        Raises:
            InstrumentError: where there is none, or something went wrong before.
        """
        if command == NEXT_ERROR:
            return str(super().ask(command, query_delay))
        # A query that fails is not answered; the question for errors, a line of its own, always is.
        answer = str(super().ask(f"{command}\n{NEXT_ERROR}", query_delay))
        error = error_in(answer)
        if error:
            raise error
        self._check(self.read())
        return answer

    def values(self, command: str, *arguments: Any, **named: Any) -> list[Any]:
        """The values that answer ``command``; NaN for a number that is not known."""
        return [known(value) for value in super().values(command, *arguments, **named)]

    def check_set_errors(self) -> list[Any]:
        """Raises what the instrument says of the setting that was made last."""
        self._check(self.ask(NEXT_ERROR))
        return []

    def _check(self, answer: str) -> None:
        error = error_in(answer)
        if error and error.number != 0:
            raise error

    def shutdown(self) -> None:
        """Turns the outputs off, and ends the connection."""
        self.write("OUTP OFF")
        super().shutdown()
        self.adapter.close()
