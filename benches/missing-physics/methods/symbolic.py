"""A formula for what the base leaves, by genetic programming with pyoperon.

As its documentation sets it up: constants by Levenberg-Marquardt, the shortest description of the data chosen from the front
of length and error. A length of 20 and 60,000 evaluations bound the time. A formula names no candidate: the verdict is `unknown`,
with the stage of the quantity that the error depends on most when its values are shuffled.
"""

import numpy as np
import residuals
from pyoperon.sklearn import SymbolicRegressor
from verdict import Finding, run

SYMBOLS = "add,sub,mul,div,constant,variable,sqrt,square"
LENGTH, EVALUATIONS, POPULATION = 20, 60_000, 500
# About so many rows are fitted to, evenly of those not held out.
ROWS = 400
SEED = 1


def find(session, data, work):
    left = residuals.of(session, work)
    rows = ~left.held_out
    told = left.is_told
    z_after, z_quantity = _formula(left.quantities, left.z_um, rows)
    r_after, r_quantity = _formula(left.quantities[told], left.resistance[told], rows[told])
    z_gain, r_gain = residuals.gains(left, z_after, r_after)
    quantity, table = (z_quantity, residuals.OF_DISPLACEMENT) if z_gain >= r_gain else (r_quantity, residuals.OF_RESISTANCE)
    return Finding(
        score=max(z_gain, r_gain),
        effects=[],
        stage=table[quantity][0],
        confidence=0.0,
        rms_before_um=left.before_um,
        rms_after_um=float(np.sqrt(np.mean(z_after[left.held_out] ** 2))),
    )


def _formula(quantities, target, rows):
    """What is left of a target after a formula, and the quantity that matters most in it."""
    scale = max(target[rows].std(), 1e-12)
    fitted = np.flatnonzero(rows)
    fitted = fitted[:: max(1, len(fitted) // ROWS)]
    search = SymbolicRegressor(
        allowed_symbols=SYMBOLS, max_length=LENGTH, population_size=POPULATION, generations=1000, max_evaluations=EVALUATIONS,
        optimizer_iterations=3, objectives=["r2", "length"], model_selection_criterion="minimum_description_length",
        n_threads=1, random_state=SEED,
    )
    search.fit(quantities[fitted], target[fitted] / scale)

    def predicted(at):
        values = np.asarray(search.predict(at)).ravel() * scale
        # A formula may have a pole between the rows that it was fitted to.
        return np.where(np.isfinite(values), np.clip(values, -20 * scale, 20 * scale), 0.0)

    after = target - predicted(quantities)
    shuffle = np.random.default_rng(SEED).permutation(len(quantities))
    worse = []
    for column in range(quantities.shape[1]):
        other = quantities.copy()
        other[:, column] = other[shuffle, column]
        worse.append(np.mean((target - predicted(other)) ** 2))
    if max(worse) <= np.mean(after**2):
        return after, ""
    return after, residuals.QUANTITIES[int(np.argmax(worse))]


if __name__ == "__main__":
    run(find)
