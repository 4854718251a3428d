"""The mirror: positions, readings, traces."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from .instrument import PORT, Instrument, InstrumentError
from .processes import EmulatedBoard, Server, ToolError

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]

#: How long a mirror takes to settle where neither a client nor the board says (s): as of ``host-tool serve``.
USUAL_SETTLING = 1.0


@dataclass(frozen=True)
class Calibration:
    """What the board is calibrated for."""

    #: The mirror's name; empty for the factory's calibration.
    device: str
    #: The day on which it was measured.
    date: str
    #: Whether the board keeps it, in words.
    kept: str


@dataclass(frozen=True)
class Pose:
    """Where the plate is."""

    #: The piston, from rest and towards the substrate (m).
    position: float
    #: Tilts about x and y (rad); NaN where the calibration does not know the plate's levers.
    tilt_x: float
    tilt_y: float


@dataclass(frozen=True)
class Uncertainty:
    """How far the plate may be from where it is asked to be: half an interval that holds it in 95 of 100 cases."""

    #: Of the piston (m); NaN where the calibration does not say what it leaves.
    position: float
    #: Of either tilt (rad); NaN likewise, and where the plate's levers are not known.
    tilt: float


@dataclass(frozen=True)
class Room:
    """How much warmer the surroundings are than at calibration; NaN where the calibration does not tell."""

    #: K.
    rise: float
    #: Its standard deviation (K).
    deviation: float


@dataclass(frozen=True)
class Trace:
    """Samples of the board, in SI units; rows are samples, columns of those with four are actuators."""

    #: Time from the first sample, in the board's time (s), shape (n,).
    time: Array
    #: Shape (n, 4), V.
    drives: Array
    #: Shape (n, 4), A.
    currents: Array
    #: Above ambient, shape (n, 4), K; NaN where a heater is driven too little to tell.
    temperatures: Array
    #: The board's position sensor, shape (n,), m; NaN where it has none.
    position: Array
    #: The limits that acted, bit by bit, shape (n,).
    limits: NDArray[np.uint16]

    def to_pandas(self) -> pandas.DataFrame:
        """A frame with the columns of a measurement file in SI units, indexed by time (s)."""
        import pandas

        columns: dict[str, Array | NDArray[np.uint16]] = {}
        for name, unit, values in (("V", "V", self.drives), ("I", "A", self.currents), ("dT", "K", self.temperatures)):
            columns |= {f"{name}{k + 1}_{unit}": values[:, k] for k in range(4)}
        columns |= {"z_m": self.position, "limits": self.limits}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="t_s"))

    def _repr_html_(self) -> str:
        lost = "" if len(self.time) < 2 else f", every {np.median(np.diff(self.time)) * 1e3:g} ms"
        return f"<p>{len(self.time)} samples{lost}; <code>to_pandas()</code> makes a frame of them</p>"

#: The bit of the questionable states that tells a stop (docs/reference/instrument.md).
_STOPPED = 1 << 11
#: The error of one that may not drive: the board was stopped beside it, or another drives.
_PROTECTED = -203


class Mirror:
    """A mirror on its driver board.

    It is held where it was moved for as long as this is open; the outputs are off afterwards, whatever becomes of this
    process.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = PORT, board: str | None = None) -> None:
        """Connects to a ``host-tool serve`` that runs, and speaks to the board with this name, or the only one there is.

        Raises:
            OSError: where nobody listens there.
            InstrumentError: where there is no such board.
        """
        self._started: tuple[Server | EmulatedBoard, ...] = ()
        self.instrument = Instrument(host, port)
        #: What the board told when :attr:`is_stopped` was asked first after a stop; empty where another answer told it.
        self.told_of_stop = ""
        if board is not None:
            quoted = board.replace('"', '""')
            try:
                self.instrument.write(f'SYST:BOAR "{quoted}"')
            except InstrumentError:
                self.instrument.close()
                raise

    @classmethod
    def start(cls, board: str | None = None) -> Self:
        """Starts a ``host-tool serve`` of its own, and connects to it.

        Raises:
            ToolError: where it does not start.
        """
        return cls._behind(Server(board))

    @classmethod
    def emulated(cls) -> Self:
        """Starts an emulated board with a virtual mirror, and all that is needed in front of it.

        Raises:
            ToolError: where it does not start.
        """
        board = EmulatedBoard()
        try:
            server = Server(board.name, board.boards)
        except ToolError:
            board.close()
            raise
        return cls._behind(server, board)

    @classmethod
    def _behind(cls, server: Server, *others: EmulatedBoard) -> Self:
        mirror = cls(*server.address)
        mirror._started = (server, *others)
        return mirror

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Turns the outputs off where they are this one's, and ends what was started for it."""
        self.instrument.close()
        for process in self._started:
            process.close()

    @property
    def name(self) -> str:
        """Maker, board, name or serial number, and firmware."""
        return self.instrument.query("*IDN?")

    @property
    def calibration(self) -> Calibration:
        """What the board is calibrated for."""
        device, date, kept = self.instrument.query("CAL?").strip('"').split('","')
        return Calibration(device, date, kept)

    @property
    def range(self) -> float:
        """The top of the calibrated range (m); its bottom is 0."""
        return self.instrument.query_numbers("POS:MAX?")[0]

    @property
    def settling(self) -> float:
        """How long the mirror takes to settle, in the board's time (s); NaN, as at first: as long as the board foresees."""
        return self.instrument.query_numbers("SETT?")[0]

    @settling.setter
    def settling(self, seconds: float) -> None:
        self.instrument.write(f"SETT {float(seconds)!r}")

    def move(self, position: float, wait: bool = True) -> None:
        """Moves the mirror to ``position`` (m), from rest and towards the substrate; waits until it has settled.

        Raises:
            InstrumentError: where it is out of range, another client drives, or the board refuses.
        """
        self.instrument.write(f"POS {float(position)!r}")
        if wait:
            self.wait()

    def tilt(self, position: float, tilt_x: float, tilt_y: float, wait: bool = True) -> None:
        """Moves the plate to a piston (m) and tilts about x and y (rad); waits until it has settled.

        Raises:
            InstrumentError: as of :meth:`move`, and where the calibration does not know the plate's levers.
        """
        self.instrument.write(f"POSE {float(position)!r},{float(tilt_x)!r},{float(tilt_y)!r}")
        if wait:
            self.wait()

    def drive(self, *volts: float, wait: bool = True) -> None:
        """Drives the actuators with one voltage for all four, or one for each (V); waits until the mirror has settled.

        Raises:
            InstrumentError: as of :meth:`move`.
        """
        self.instrument.write("VOLT " + ",".join(repr(float(one)) for one in volts))
        if wait:
            self.wait()

    def settles_in(self) -> float:
        """How long it is until the mirror has settled, as the board foresees, in its time (s): 0 when it has. NaN where nothing
        is asked for, where a limit keeps it away, and under a calibration that was never tried on the mirror."""
        return self.instrument.query_numbers("MEAS:SETT?")[0]

    def wait(self) -> None:
        """Waits until the mirror has settled after what was asked for last.

        Raises:
            InstrumentError: where a limit keeps it away for good (-365).
        """
        left = self.settling
        if np.isnan(left):
            left = self.settles_in()
        self.instrument.query("*OPC?", wait=USUAL_SETTLING if np.isnan(left) else left)

    def off(self) -> None:
        """Turns all channels off, whoever drives."""
        self.instrument.write("OUTP OFF")

    def clear(self) -> None:
        """Lets the board forget its faults."""
        self.instrument.write("OUTP:PROT:CLE")

    def lock(self) -> None:
        """Asks to drive alone, and forgets errors that wait. Once the board was stopped beside this one, by ``host-tool off`` or a
        reset, nothing else lets it drive again.

        Raises:
            InstrumentError: where another client drives.
        """
        if self.instrument.query("*CLS;:SYST:LOCK:REQ?") != "1":
            owner = self.instrument.query("SYST:LOCK:OWN?").strip('"')
            raise InstrumentError(_PROTECTED, f"driven by {owner}; Mirror.off turns it off nevertheless")

    @property
    def is_stopped(self) -> bool:
        """Whether the board was stopped beside this one, which drives it again after :meth:`lock`."""
        try:
            states = self.instrument.query("STAT:QUES:COND?")
        except InstrumentError as error:
            # A stop is told once as an error of whatever is asked next, which is this; what is asked here is just that.
            if error.number != _PROTECTED:
                raise
            self.told_of_stop = str(error)
            states = self.instrument.query("STAT:QUES:COND?")
        return bool(int(states) & _STOPPED)

    @property
    def is_driven(self) -> bool:
        """Whether anything is driven."""
        return self.instrument.query("OUTP?") == "1"

    @property
    def channels(self) -> list[str]:
        """What each channel is doing; a fault by its name."""
        return self.instrument.query("STAT:CHAN?").strip('"').split('","')

    @property
    def limits(self) -> list[str]:
        """The limits that have acted since the mirror was moved."""
        return self.instrument.query("STAT:LIM?").strip('"').split()

    def asked(self) -> float:
        """The position that the mirror was asked for and is held at, by whichever client (m); NaN where there is none."""
        return self.instrument.query_numbers("POS?")[0]

    def position(self) -> float:
        """The board's position sensor (m); NaN where it has none."""
        return self.instrument.query_numbers("MEAS:POS?")[0]

    def pose(self) -> Pose:
        """Where the board has taken the plate, as it counts, without a sensor."""
        return Pose(*self.instrument.query_numbers("MEAS:POSE?"))

    def uncertainty(self) -> Uncertainty:
        """How far the plate may be from there."""
        return Uncertainty(*self.instrument.query_numbers("MEAS:UNC?"))

    def room(self) -> Room:
        """How much warmer it is than at calibration."""
        return Room(*self.instrument.query_numbers("MEAS:ROOM?"))

    def drives(self) -> Array:
        """What is driven (V), shape (4,)."""
        return self._measured("VOLT")

    def currents(self) -> Array:
        """What flows (A), shape (4,)."""
        return self._measured("CURR")

    def resistances(self) -> Array:
        """The heaters' resistances (ohm), shape (4,); NaN where one is driven too little to tell."""
        return self._measured("RES")

    def temperatures(self) -> Array:
        """The heaters' temperatures above ambient (K), shape (4,); NaN likewise."""
        return self._measured("TEMP")

    def _measured(self, what: str) -> Array:
        return np.array(self.instrument.query_numbers(f"MEAS:{what}?"))

    def trace(self, count: int, period: float) -> Trace:
        """``count`` samples, one every ``period`` (s), which is whole ticks of 0.1 ms; at most 65536, and 1677 s. One that is lost on
        the way is missing.

        Raises:
            InstrumentError: where they are too many, the period is between two ticks, or the board does not send them.
        """
        names = self.instrument.query("TRAC:COL?").strip('"').split(",")
        block = self.instrument.query_block(f"TRAC? {count},{float(period)!r}", wait=count * period)
        rows = np.frombuffer(block, "<f4").reshape(-1, len(names)).astype(np.float64)
        column = {name: rows[:, k] for k, name in enumerate(names)}

        def four(name: str, unit: str) -> Array:
            return np.column_stack([column[f"{name}{k}_{unit}"] for k in range(1, 5)])

        # Whole periods: what a 32-bit float cannot tell of the time.
        steps = np.rint(column["t_s"] / period)
        limits = column["limits"].astype(np.uint16)
        return Trace(
            steps * period, four("V", "V"), four("I", "A"), four("dT", "K"), column["z_m"], limits
        )

    def scan(self, positions: Array) -> Array:
        """Moves to each of ``positions`` (m, shape (n,)), and returns what the position sensor reads there (m)."""

        def reached(position: float) -> float:
            self.move(position)
            return self.position()

        return np.array([reached(float(position)) for position in positions])

    def _repr_html_(self) -> str:
        rows = {
            "board": self.name,
            "channels": ", ".join(self.channels),
            "position": f"{self.position() * 1e6:.3f} µm of {self.range * 1e6:.1f} µm",
            "limited by": ", ".join(self.limits) or "nothing",
        }
        cells = (f"<tr><th>{name}</th><td>{escape(text)}</td></tr>" for name, text in rows.items())
        return f"<table>{''.join(cells)}</table>"
