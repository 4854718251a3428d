"""Mirrors as an EPICS soft IOC, for what goes past one machine: ``python -m electrothermal_mirror.drivers.epics``.

Each board has the process variables of :class:`MirrorRecords` under the prefix and its own name: ``LAB:emulated:POSITION``.
A put to ``POSITION`` that waits for its callback ends when the mirror has settled, and fails where it was not moved.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from ipaddress import ip_address
from typing import Any

from caproto import AlarmSeverity, AlarmStatus, CaprotoRuntimeError
from caproto.server import PVGroup, pvproperty, run

from ..instrument import PORT, Instrument, InstrumentError
from ..mirror import Mirror

#: From one reading of a board to the next (s).
PERIOD = 0.2
NAN = float("nan")


class MirrorRecords(PVGroup):  # type: ignore[misc]
    """What EPICS sees of one mirror, in SI units. Readings of a board that does not answer are invalid, by their alarm."""

    position = pvproperty(name="POSITION", value=0.0, units="m", precision=9, doc="Where the mirror is to be, from rest.")
    off = pvproperty(name="OFF", value=0, doc="A put turns the outputs off.")
    sensor = pvproperty(name="SENSOR", value=NAN, units="m", precision=9, read_only=True, doc="The board's position sensor.")
    drives = pvproperty(name="DRIVES", value=[NAN] * 4, units="V", read_only=True, doc="What is driven.")
    currents = pvproperty(name="CURRENTS", value=[NAN] * 4, units="A", read_only=True, doc="What flows.")
    temperatures = pvproperty(name="TEMPERATURES", value=[NAN] * 4, units="K", read_only=True, doc="Heaters, above ambient.")
    state = pvproperty(name="STATE", value="", max_length=400, read_only=True, doc="What the channels do, or what is wrong.")

    def __init__(self, mirror: Mirror, reader: Mirror, prefix: str) -> None:
        """Moves ``mirror``, and reads it by another connection meanwhile, under names that begin with ``prefix``."""
        super().__init__(prefix=prefix)
        self.mirror = mirror
        self.reader = reader

    @position.putter
    async def position(self, _instance: Any, value: float) -> None:
        """Moves, and waits until the mirror has settled."""
        await self._asked(self.mirror.move, float(value))

    @off.putter
    async def off(self, _instance: Any, _value: int) -> int:
        """Turns off."""
        await self._asked(self.mirror.off)
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
            else:
                for record, value in readings:
                    await record.write(value, status=AlarmStatus.NO_ALARM, severity=AlarmSeverity.NO_ALARM)
            await asyncio.sleep(PERIOD)

    def _read(self) -> list[tuple[Any, Any]]:
        mirror = self.reader
        return [
            (self.sensor, mirror.position()),
            (self.drives, mirror.drives()),
            (self.currents, mirror.currents()),
            (self.temperatures, mirror.temperatures()),
            (self.state, ", ".join(mirror.channels)),
        ]

    async def _invalidate(self) -> None:
        for record in (self.sensor, self.drives, self.currents, self.temperatures, self.state):
            await record.alarm.write(status=AlarmStatus.COMM, severity=AlarmSeverity.INVALID_ALARM)

    async def _asked(self, what: Any, *values: float) -> None:
        try:
            await asyncio.to_thread(what, *values)
        except (InstrumentError, OSError) as error:
            # The client is told that its put failed; why stands in STATE.
            await self.state.write(str(error)[:400])
            raise CaprotoRuntimeError(str(error)) from None


def records(address: tuple[str, int], prefix: str) -> dict[str, Any]:
    """The process variables of all boards of a ``host-tool serve``, by name."""
    with Instrument(*address) as instrument:
        boards = instrument.query("SYST:BOAR:CAT?").strip('"').split('","')
    database: dict[str, Any] = {}
    for board in filter(None, boards):
        mirror, reader = (Mirror(*address, board=board) for _ in range(2))
        database |= MirrorRecords(mirror, reader, f"{prefix}{board}:").pvdb
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
