"""Sparse regression of what the base leaves, by PySINDy.

A discrepancy model [Kaheman and others 2019]: the residual as a sparse combination of a library of the quantities. Sequentially
thresholded least squares on bootstrapped rows, of which the median is taken, as PySINDy's authors advise for noisy data [Fasel and
others 2022]. The threshold is PySINDy's own, 0.1, in spreads of the residual. The ridge is larger than its own, 1, since drive,
temperature and displacement go together, and smaller ones make up sums of large terms that cancel.

The term with the largest share says the stage, by the tables of `residuals`. It names a candidate where its share of what is
explained is at least `CLEAR`; otherwise the verdict is `unknown`.
"""

import warnings

import numpy as np
import pysindy
import residuals
from verdict import Finding, run

THRESHOLD, RIDGE, MODELS = 0.1, 1.0, 20
CLEAR = 0.8
SEED = 1


def find(session, data, work):
    left = residuals.of(session, work)
    rows = ~left.held_out
    z_after, z_terms = _regress(left.quantities, left.z_um, rows)
    told = left.is_told
    r_after, r_terms = _regress(left.quantities[told], left.resistance[told], rows[told])
    z_gain, r_gain = residuals.gains(left, z_after, r_after)
    terms, table = (z_terms, residuals.OF_DISPLACEMENT) if z_gain >= r_gain else (r_terms, residuals.OF_RESISTANCE)
    quantity, share = _largest(terms)
    stage, candidate = table[quantity]
    after_um = np.sqrt(np.mean(z_after[left.held_out] ** 2))
    return Finding(
        score=max(z_gain, r_gain),
        effects=[candidate] if share >= CLEAR else [],
        stage=stage,
        confidence=share,
        rms_before_um=left.before_um,
        rms_after_um=float(after_um),
    )


def _regress(quantities, target, rows):
    """What is left of a target after sparse regression, and each term's quantities with its root mean square."""
    library = pysindy.PolynomialLibrary(degree=3, include_interaction=False, include_bias=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        terms = np.asarray(library.fit_transform(quantities))
        names = library.get_feature_names(residuals.QUANTITIES)
        scale = max(target[rows].std(), 1e-12)
        sparse = pysindy.EnsembleOptimizer(
            pysindy.STLSQ(threshold=THRESHOLD, alpha=RIDGE),
            bagging=True, n_models=MODELS, ensemble_aggregator=lambda found: np.median(found, axis=0),
        )
        np.random.seed(SEED)
        sparse.fit(terms[rows], (target[rows] / scale)[:, None])
    coefficients = np.asarray(sparse.coef_).ravel()
    parts = terms * coefficients * scale
    sizes = {}
    for name, part in zip(names, parts.T):
        quantity = "" if name == "1" else name.split("^")[0]
        sizes[quantity] = sizes.get(quantity, 0.0) + part
    shares = {quantity: float(np.mean((part - (0 if quantity == "" else part.mean())) ** 2)) for quantity, part in sizes.items()}
    return target - parts.sum(axis=1), shares


def _largest(shares):
    quantity = max(shares, key=shares.get)
    total = sum(shares.values())
    return quantity, shares[quantity] / total if total > 0.0 else 0.0


if __name__ == "__main__":
    run(find)
