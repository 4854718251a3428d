"""Mirrors as an EPICS soft IOC, for what goes past one machine: ``python -m electrothermal_mirror.drivers.epics``.

Each board has the process variables of :class:`MirrorRecords` under the prefix and its own name: ``LAB:emulated:POSITION``.
A put to ``POSITION`` that waits for its callback ends when the mirror has settled, and fails where it was not moved; why stands in
``MESSAGE``. Once the board was stopped beside the IOC nothing is driven before a put to ``CLEAR``.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Callable
from functools import partial
from ipaddress import ip_address
from math import isnan
from typing import Any

from caproto import AlarmSeverity, AlarmStatus, CaprotoRuntimeError
from caproto.server import PVGroup, pvproperty, run

from ..instrument import PORT, Instrument, InstrumentError
from ..mirror import Mirror

#: From one reading of a board to the next (s).
PERIOD = 0.2
NAN = float("nan")
#: The alarms of a reading that is true, of a board that does not answer, of a position that is not held, and of a stop.
TRUE = {"status": AlarmStatus.NO_ALARM, "severity": AlarmSeverity.NO_ALARM}
UNANSWERED = {"status": AlarmStatus.COMM, "severity": AlarmSeverity.INVALID_ALARM}
NOT_HELD = {"status": AlarmStatus.UDF, "severity": AlarmSeverity.INVALID_ALARM}
STOPPED = {"status": AlarmStatus.DISABLE, "severity": AlarmSeverity.MAJOR_ALARM}


class MirrorRecords(PVGroup):  # type: ignore[misc]
    """What EPICS sees of one mirror, in SI units. Readings of a board that does not answer are invalid, by their alarm, and so is
    a position that is not held."""

    position = pvproperty(name="POSITION", value=NAN, units="m", precision=9, doc="Where the mirror is held, from rest.")
    off = pvproperty(name="OFF", value=0, doc="A put turns the outputs off.")
    clear = pvproperty(name="CLEAR", value=0, doc="A put lets the board be driven again after faults and stops.")
    sensor = pvproperty(name="SENSOR", value=NAN, units="m", precision=9, read_only=True, doc="The board's position sensor.")
    drives = pvproperty(name="DRIVES", value=[NAN] * 4, units="V", read_only=True, doc="What is driven.")
    currents = pvproperty(name="CURRENTS", value=[NAN] * 4, units="A", read_only=True, doc="What flows.")
    temperatures = pvproperty(name="TEMPERATURES", value=[NAN] * 4, units="K", read_only=True, doc="Heaters, above ambient.")
    state = pvproperty(name="STATE", value="", max_length=400, read_only=True, doc="What the channels do, or what is wrong.")
    message = pvproperty(name="MESSAGE", value="", max_length=400, read_only=True, doc="What went wrong since a put went well.")

    def __init__(self, connect: Callable[[], Mirror], prefix: str) -> None:
        """Moves a mirror that ``connect`` gives, and reads it by another connection meanwhile, under names that begin with ``prefix``."""
        super().__init__(prefix=prefix)
        self.connect = connect
        self.mirror, self.reader = connect(), connect()
        self.is_stopped = False
        #: Of who speaks by the connection that moves.
        self.turn = asyncio.Lock()

    @position.putter
    async def position(self, instance: Any, value: float) -> None:
        """Moves, and waits until the mirror has settled."""
        async with self.turn:
            await self._asked(self._move, float(value))
        await instance.alarm.write(**TRUE)

    @off.putter
    async def off(self, _instance: Any, _value: int) -> int:
        """Turns off, also while a move waits for the mirror to settle, which fails then."""
        if self.turn.locked():
            await self._asked(self.reader.off)
        else:
            async with self.turn:
                await self._asked(self.mirror.off)
        return 0

    @clear.putter
    async def clear(self, _instance: Any, _value: int) -> int:
        """Lets the board forget faults, and this IOC that it was stopped."""
        async with self.turn:
            await self._asked(self._clear)
        return 0

    @state.startup
    async def state(self, instance: Any, _library: Any) -> None:
        """Reads the board for as long as this runs."""
        while True:
            try:
                readings = await asyncio.to_thread(self._read)
            except (InstrumentError, OSError) as error:
                await self._invalidate()
                await instance.write(str(error)[:400])
                if isinstance(error, OSError):
                    await self.connect_again()
            else:
                for record, value, alarm in readings:
                    await record.write(value, **alarm)
                await self._look()
            await asyncio.sleep(PERIOD)

    async def connect_again(self) -> None:
        """Connects to a ``serve`` that is there again, where it is; the one that ended has turned the mirror off."""
        try:
            mirror = await asyncio.to_thread(self.connect)
            reader = await asyncio.to_thread(self.connect)
        except (InstrumentError, OSError):
            return
        async with self.turn:
            self.mirror.close()
            self.reader.close()
            self.mirror, self.reader = mirror, reader
            self.is_stopped = False

    def _read(self) -> list[tuple[Any, Any, Any]]:
        mirror = self.reader
        doing = ", ".join(mirror.channels)
        state = (f"stopped, and driven again after a put to CLEAR; {doing}", STOPPED) if self.is_stopped else (doing, TRUE)
        return [
            (self.sensor, mirror.position(), TRUE),
            (self.drives, mirror.drives(), TRUE),
            (self.currents, mirror.currents(), TRUE),
            (self.temperatures, mirror.temperatures(), TRUE),
            (self.state, *state),
        ]

    async def _look(self) -> None:
        """Shows where the mirror is held, and what ended it; not while a put is on its way, whose answer tells that."""
        if self.turn.locked():
            return
        async with self.turn:
            try:
                asked, self.is_stopped = await asyncio.to_thread(lambda: (self.mirror.asked(), self.mirror.is_stopped))
            except (InstrumentError, OSError) as error:
                await self.message.write(str(error)[:400])
            else:
                if told := self.mirror.told_of_stop:
                    self.mirror.told_of_stop = ""
                    await self.message.write(told[:400])
                await self.position.write(asked, verify_value=False, **(NOT_HELD if isnan(asked) else TRUE))

    def _move(self, position: float) -> None:
        # What went wrong before is not of this move; a stop that is still to be cleared is told again.
        self.mirror.instrument.write("*CLS")
        self.mirror.move(position)

    def _clear(self) -> None:
        self.mirror.lock()
        self.mirror.clear()
        self.is_stopped = False

    async def _invalidate(self) -> None:
        for record in (self.position, self.sensor, self.drives, self.currents, self.temperatures, self.state):
            await record.alarm.write(**UNANSWERED)

    async def _asked(self, what: Any, *values: float) -> None:
        try:
            await asyncio.to_thread(what, *values)
        except (InstrumentError, OSError) as error:
            await self.message.write(str(error)[:400])
            # The client is told that its put failed.
            raise CaprotoRuntimeError(str(error)) from None
        await self.message.write("")


def records(address: tuple[str, int], prefix: str) -> dict[str, Any]:
    """The process variables of all boards of a ``host-tool serve``, by name."""
    with Instrument(*address) as instrument:
        boards = instrument.query("SYST:BOAR:CAT?").strip('"').split('","')
    database: dict[str, Any] = {}
    for board in filter(None, boards):
        database |= MirrorRecords(partial(Mirror, *address, board=board), f"{prefix}{board}:").pvdb
    return database


def main() -> None:
    """Serves until it is interrupted; the mirrors are off then."""
    parser = argparse.ArgumentParser(prog="python -m electrothermal_mirror.drivers.epics", description=__doc__)
    parser.add_argument("--prefix", default="MIRROR:", help="what all names begin with (%(default)s)")
    parser.add_argument("--host", default="127.0.0.1", help="where host-tool serve is (%(default)s)")
    parser.add_argument("--port", type=int, default=PORT, help="and its port (%(default)s)")
    parser.add_argument(
        "--interface",
        default="127.0.0.1",
        help="the address of this machine to listen on (%(default)s); whoever reaches it drives the mirrors",
    )
    asked = parser.parse_args()
    if not ip_address(asked.interface).is_loopback:
        print(
            f"warning: whoever reaches this machine at {asked.interface} drives the mirrors, without a password; "
            "without --interface only this machine is let in",
            file=sys.stderr,
        )
    run(records((asked.host, asked.port), asked.prefix), interfaces=[asked.interface], log_pv_names=True)


if __name__ == "__main__":
    main()
