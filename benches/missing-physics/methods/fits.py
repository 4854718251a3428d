"""Least-squares fits of the base and of the base with each candidate, by lmfit, kept in a folder.

Only rows that are not held out are fitted. A residual is in units of its noise and of what lumped equations cannot follow: 0.1 um,
and of a current 3e-4 of it, as the project's own fits weigh them.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import lmfit
import numpy as np
import piston
from session import ACTUATORS, Session

LUMPED_UM = 0.1
LUMPED_SHARE = 3e-4
# What such a current sense is known to (A): a 12-bit converter over 10 mA.
CURRENT_A = 2e-6
# Steps of the simulation in units of the time since the last jump of the drive: 2e-8 um off those of a tenth of it.
RESOLUTION = 0.5
# A fit evaluates its model so often at most, times one more than its parameters.
EVALUATIONS = 12
# Relative step of a finite difference: above what the fixed point of power and temperature leaves.
STEP = 1e-4
BOUNDS = [(100.0, 1000.0)] * 4 + [(500.0, 50000.0)] * 4 + [(0.05, 5.0), (1e-4, 0.1), (1e-3, 0.9), (2e-3, 1.0)]


@dataclass
class Fit:
    """A fitted model: the base alone, or with candidate number `effect`; lmfit's BIC of the rows fitted."""

    effect: int
    base: list[float]
    parameters: list[float]
    bic: float

    @property
    def name(self) -> str:
        """What the candidate is called."""
        return "" if self.effect < 0 else piston.CANDIDATES[self.effect][0]


def predict(session: Session, fit: Fit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacements (um), currents (A) and mean temperature rises (K) of every row."""
    return _simulate(session, np.array(fit.base), fit.effect, fit.parameters)


def residuals(session: Session, fit: Fit) -> np.ndarray:
    """Measured less predicted of displacement and currents (rows, 5), standardised."""
    z, amperes, _ = predict(session, fit)
    return _standardised(session, z, amperes)


def held_out_rms(session: Session, z: np.ndarray) -> float:
    """Error of a displacement on the rows held out (um)."""
    off = (session.z_um - z)[session.held_out]
    return float(np.sqrt(np.mean(off**2)))


def all_fits(session: Session, work: Path) -> list[Fit]:
    """The base, and every candidate with it."""
    place = work / "fits" / f"{session.id}.json"
    if place.exists():
        return [Fit(**kept) for kept in json.loads(place.read_text())]
    base = _base(session)
    fits = [base] + [_with(session, base, effect) for effect in range(len(piston.CANDIDATES))]
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps([asdict(fit) for fit in fits]))
    return fits


def _simulate(session, base, effect, parameters):
    padded = np.zeros(5)
    padded[: len(parameters)] = parameters
    intervals = session.duration_s, session.from_v, session.to_v, session.row
    return piston.simulate(*intervals, base, effect, padded, RESOLUTION, len(session.z_um))


def _standardised(session, z, amperes):
    um = np.hypot(session.noise_um, LUMPED_UM)
    ampere = np.hypot(CURRENT_A, LUMPED_SHARE * session.amperes)
    return np.column_stack([(session.z_um - z) / um, (session.amperes - amperes) / ampere])


def _base(session):
    fits = []
    cold = session.volts[:, 0] > 0.1
    coldest = np.argsort(session.volts[cold, 0])[: max(1, cold.sum() // 20)]
    ohm = np.median(session.volts[cold][coldest] / session.amperes[cold][coldest], axis=0)
    for fast, weight, second in piston.TIMES:
        start = [*ohm, *[5e3] * ACTUATORS, 1.2, fast, weight, second]
        fits.append(_fit(session, piston.NONE, start, []))
    return min(fits, key=lambda fit: fit.bic)


def _with(session, base, effect):
    usual = [start for start, _, _ in piston.CANDIDATES[effect][2]]
    return _fit(session, effect, base.base, usual)


def _fit(session, effect, base, parameters):
    start = np.array([*base, *parameters])
    of_effect = [limits[1:] for limits in piston.CANDIDATES[effect][2]] if parameters else []
    # In units of where the fit starts: lmfit takes bounds that lie within 1e-13 of each other for one.
    scale = np.abs(start)
    unknowns = lmfit.Parameters()
    for index, (value, bounds) in enumerate(zip(start / scale, BOUNDS + of_effect)):
        low, high = np.array(bounds) / scale[index]
        inside = np.clip(value, low + 1e-3 * (high - low), high - 1e-3 * (high - low))
        unknowns.add(f"p{index}", value=inside, min=low, max=high)
    fitted = ~session.held_out

    def values(at):
        return np.fromiter(at.valuesdict().values(), float) * scale

    def off(at):
        now = values(at)
        z, amperes, _ = _simulate(session, now[: len(base)], effect, now[len(base) :])
        rows = _standardised(session, z, amperes)[fitted].ravel()
        return rows if np.isfinite(rows).all() else np.full(rows.size, 1e6)

    most = EVALUATIONS * (len(unknowns) + 1)
    found = lmfit.minimize(
        off, unknowns, method="leastsq", max_nfev=most, calc_covar=False, ftol=1e-6, xtol=1e-6, epsfcn=STEP**2
    )
    best = values(found.params).tolist()
    return Fit(effect, best[: len(base)], best[len(base) :], float(found.bic))
