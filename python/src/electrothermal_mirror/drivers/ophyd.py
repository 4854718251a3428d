"""The mirror in ophyd-async, and so in bluesky's plans: ``ElectrothermalMirror(Mirror.start(), "mirror")``."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress

from bluesky.plan_stubs import null
from bluesky.preprocessors import contingency_wrapper
from bluesky.protocols import Movable, Reading, Stoppable
from bluesky.utils import MsgGenerator
from event_model import DataKey
from ophyd_async.core import AsyncStatus, Device

from ..instrument import InstrumentError
from ..mirror import Mirror


class ElectrothermalMirror(Device, Movable[float], Stoppable):
    """A mirror that plans move, and whose sensor and currents they read; a move is done once the mirror has settled."""

    def __init__(self, mirror: Mirror, name: str = "") -> None:
        """Speaks to ``mirror``, which stays its owner's to close."""
        self.mirror = mirror
        super().__init__(name)

    @AsyncStatus.wrap
    async def set(self, value: float) -> None:
        """Moves to ``value`` (m)."""
        await asyncio.to_thread(self.mirror.move, value)

    async def stop(self, success: bool = True) -> None:
        """Turns the outputs off; where the plan went well the mirror is held as it is."""
        if not success:
            await asyncio.to_thread(self.mirror.off)

    async def describe(self) -> dict[str, DataKey]:
        """What a reading consists of."""

        def key(shape: list[int], units: str) -> DataKey:
            dtype = "array" if shape else "number"
            return DataKey(source=f"scpi://{self.name}", dtype=dtype, shape=shape, units=units)

        return {self._key("position"): key([], "m"), self._key("currents"): key([4], "A")}

    async def read(self) -> dict[str, Reading]:
        """The position sensor (m) and the currents (A)."""
        position = await asyncio.to_thread(self.mirror.position)
        currents = await asyncio.to_thread(self.mirror.currents)
        now = time.time()
        return {
            self._key("position"): Reading(value=position, timestamp=now),
            self._key("currents"): Reading(value=currents, timestamp=now),
        }

    def _key(self, what: str) -> str:
        return f"{self.name}-{what}"


def off_after_failure(plan: MsgGenerator, mirrors: Sequence[ElectrothermalMirror]) -> MsgGenerator:
    """``plan``; where it fails all of ``mirrors`` that still answer are turned off, which bluesky itself leaves as they are."""

    def turn_off(_error: Exception) -> MsgGenerator:
        for mirror in mirrors:
            with suppress(InstrumentError, OSError):
                mirror.mirror.off()
        yield from null()

    return (yield from contingency_wrapper(plan, except_plan=turn_off))
