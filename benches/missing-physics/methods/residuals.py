"""What the fitted base leaves, beside quantities that could explain it: what the regressions work on.

Two residuals: of the displacement (um), and of the mean resistance (relative). The quantities are those that a bench has or that
follow from them, each divided by its largest magnitude.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import piston
from fits import CURRENT_A, LUMPED_SHARE, LUMPED_UM, all_fits, held_out_rms, predict
from session import Session

# Drives below this tell no resistance: the current's noise is a percent of it (V).
TOLD_V = 0.5
# Time constants of the memories that are offered (s): between the thermal poles and a session's length.
MEMORY_S = 5.0
# V mean drive, T temperature rise of the resistance, z displacement, t time, P power of all four, z_late and P_late their first-order
# lags, s the way that z goes, v its rate.
QUANTITIES = ["V", "T", "z", "t", "P", "z_late", "P_late", "s", "v"]

# What a quantity that a residual depends on says: the stage, and the candidate that depends on it so. A displacement that is off
# where the resistance is right is off behind it.
OF_DISPLACEMENT = {
    "V": ("shape", "electrostatic-pull"),
    "T": ("curvature", "expansion-temperature"),
    "z": ("sensor", "sensor-nonlinearity"),
    "t": ("heat", "ambient-drift"),
    "P": ("heat", "substrate-warming"),
    "z_late": ("memory", "creep"),
    "P_late": ("heat", "substrate-warming"),
    "s": ("memory", "hysteresis"),
    "v": ("sensor", "sensor-lag"),
    "": ("sensor", "sensor-offset"),
}
OF_RESISTANCE = {
    "V": ("drive", "series-resistance"),
    "T": ("heat", "heat-loss-temperature"),
    "z": ("heat", "gap-heat-loss"),
    "t": ("heat", "ambient-drift"),
    "P": ("heat", "crosstalk"),
    "z_late": ("heat", "substrate-warming"),
    "P_late": ("heat", "substrate-warming"),
    "s": ("heat", "thermal-lag"),
    "v": ("heat", "thermal-lag"),
    "": ("resistance", "film-tcr"),
}


@dataclass
class Residuals:
    """Rows of quantities (rows, 9), and what is left: `z_um` (rows), `resistance` (rows; where `is_told`).

    `z_worth` and `resistance_worth` (rows) are what noise and lumped equations leave of either at least, as the fits weigh them.
    """

    quantities: np.ndarray
    z_um: np.ndarray
    resistance: np.ndarray
    z_worth: np.ndarray
    resistance_worth: np.ndarray
    is_told: np.ndarray
    held_out: np.ndarray
    before_um: float


def of(session: Session, work: Path) -> Residuals:
    """What the base fitted to the rows not held out leaves of all."""
    base = all_fits(session, work)[0]
    z, amperes, modelled_k = predict(session, base)
    is_told = (session.volts > TOLD_V).all(axis=1)
    ohm = session.volts / np.where(is_told[:, None], session.amperes, 1.0)
    modelled_ohm = np.where(is_told[:, None], session.volts, 1.0) / np.where(is_told[:, None], amperes, 1.0)
    relative = np.where(is_told, (ohm / modelled_ohm - 1.0).mean(axis=1), 0.0)
    rise_k = ((ohm / np.array(base.base[:4]) - 1.0) / piston.XI).mean(axis=1)
    temperature = np.where(is_told, rise_k, modelled_k)
    power = (session.volts * session.amperes).sum(axis=1)
    # The way and rate of the modelled displacement, whose noise they do not have.
    step_um = np.diff(z, prepend=0.0)
    step_s = np.maximum(np.diff(session.t_s, prepend=0.0), 1e-6)
    columns = [
        session.volts.mean(axis=1), temperature, session.z_um, session.t_s, power,
        _late(z, step_s), _late(power, step_s), np.sign(np.where(np.abs(step_um) > 1e-3, step_um, 0.0)), step_um / step_s,
    ]
    quantities = np.column_stack([column / np.abs(column).max() for column in columns])
    left = session.z_um - z
    z_worth = np.full_like(z, np.hypot(session.noise_um, LUMPED_UM))
    resistance_worth = np.hypot(LUMPED_SHARE, CURRENT_A / np.where(is_told, session.amperes.mean(axis=1), 1.0))
    before_um = held_out_rms(session, z)
    return Residuals(quantities, left, relative, z_worth, resistance_worth, is_told, session.held_out, before_um)


def gains(left: Residuals, z_after: np.ndarray, r_after: np.ndarray) -> tuple[float, float]:
    """The gain in displacement and in resistance of what is left after a formula for each (rows; rows that are told)."""
    told = left.is_told
    out, out_told = left.held_out, left.held_out[told]
    of_z = gain(left.z_um[out], z_after[out], left.z_worth[out])
    of_r = gain(left.resistance[told][out_told], r_after[out_told], left.resistance_worth[told][out_told])
    return of_z, of_r


def _late(x, step_s):
    late, now = np.empty_like(x), 0.0
    for index, (value, h) in enumerate(zip(x, step_s)):
        now = value + (now - value) * np.exp(-h / MEMORY_S)
        late[index] = now
    return late


def gain(left: np.ndarray, after: np.ndarray, worth: np.ndarray) -> float:
    """By how much a formula lowers the sum of squares on rows held out, in units of what a row is worth.

    Its share says less: what the lumped base leaves of a mirror with nothing hidden follows formulas as well, and is smaller.
    """
    return float(np.sum((left**2 - after**2) / worth**2))
