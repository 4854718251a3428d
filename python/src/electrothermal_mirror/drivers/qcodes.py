"""The mirror in QCoDeS: ``ElectrothermalMirror("mirror", Mirror.start())``."""

from __future__ import annotations

from typing import Any

from qcodes.instrument import Instrument
from qcodes.validators import Arrays, Numbers

from ..mirror import Mirror


class ElectrothermalMirror(Instrument):
    """A mirror whose position is a parameter; setting it waits until the mirror has settled."""

    def __init__(self, name: str, mirror: Mirror, **arguments: Any) -> None:
        """Takes ``mirror`` over: closing this closes it."""
        super().__init__(name, **arguments)
        self.mirror = mirror
        self.add_parameter(
            "position",
            unit="m",
            label="Position",
            vals=Numbers(0.0, mirror.range),
            get_cmd=mirror.asked,
            set_cmd=mirror.move,
            docstring="Where the mirror is asked to be, from rest and towards the substrate; NaN where nothing holds it.",
        )
        self.add_parameter("sensor", unit="m", label="Position sensor", get_cmd=mirror.position)
        for what, unit, measure in (
            ("drives", "V", mirror.drives),
            ("currents", "A", mirror.currents),
            ("resistances", "Ohm", mirror.resistances),
            ("temperatures", "K", mirror.temperatures),
        ):
            self.add_parameter(what, unit=unit, get_cmd=measure, vals=Arrays(shape=(4,)))

    def get_idn(self) -> dict[str, str | None]:
        """Maker, board, name or serial number, and firmware."""
        vendor, model, serial, firmware = self.mirror.name.split(",")
        return {"vendor": vendor, "model": model, "serial": serial, "firmware": firmware}

    def close(self) -> None:
        """Turns the outputs off, and lets go of the board."""
        self.mirror.close()
        super().close()
