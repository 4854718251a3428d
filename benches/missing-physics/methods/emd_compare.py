"""The candidates of `bic_lmfit` compared by the empirical model discrepancy (emdcmp).

Each fitted model generates rows with the white noise that it leaves of the rows it was fitted to; the loss is the negative log
likelihood of a row, and the risks are compared on the rows held out, as the authors ask. `c` is 1/2, the upper end of what worked in
their experiments. A model is compared with the base by how far apart the two distributions of its risk are, in standard deviations:
the criterion itself, the probability that one risk is below the other, is 1 for most. Candidates whose probability of a lower risk
than the best one's is above 5 % are named with it.

Sampling risks is slow: only the base and the candidates of the lowest BIC are compared.
"""

import numpy as np
from emdcmp import draw_R_samples, make_empirical_risk_ppf
from fits import all_fits, held_out_rms, predict, residuals
from session import stages
from verdict import Finding, run

C = 0.5
COMPARED = 3
ALIKE = 0.05
# Paths of quantiles and their resolution: the least that the authors use.
PATHS, RESOLUTION = 32, 6
SYNTHETIC = 4000
SEED = 1


def find(session, data, work):
    base, *candidates = all_fits(session, work)
    candidates.sort(key=lambda fit: fit.bic)
    compared = list({fit.name: fit for fit in reversed(candidates)}.values())
    compared = sorted(compared, key=lambda fit: fit.bic)[:COMPARED]
    of_base = _risks(session, base)
    risks = [_risks(session, fit) for fit in compared]
    order = np.argsort([risk.mean() for risk in risks])
    best = compared[order[0]]
    lowest = risks[order[0]]
    names, confidence = [best.name], 1.0
    for index in order[1:]:
        below = float(np.less.outer(risks[index], lowest).mean())
        if below > ALIKE:
            names.append(compared[index].name)
        else:
            confidence = min(confidence, 1.0 - below)
    apart = (of_base.mean() - lowest.mean()) / np.hypot(of_base.std(), lowest.std())
    return Finding(
        score=float(apart),
        effects=names,
        stage=stages(data)[best.name],
        confidence=confidence,
        rms_before_um=held_out_rms(session, predict(session, base)[0]),
        rms_after_um=held_out_rms(session, predict(session, best)[0]),
    )


def _risks(session, fit):
    """Samples of the expected risk of a fitted model."""
    off = residuals(session, fit)
    spread = off[~session.held_out].std(axis=0)
    rng = np.random.default_rng(SEED)

    def loss(rows):
        return (0.5 * (rows / spread) ** 2 + np.log(spread)).sum(axis=1)

    mixed = make_empirical_risk_ppf(loss(off[session.held_out]))
    synthetic = make_empirical_risk_ppf(loss(rng.normal(size=(SYNTHETIC, off.shape[1])) * spread))
    return draw_R_samples(mixed, synthetic, c=C, M=PATHS, max_M=PATHS, res=RESOLUTION)


if __name__ == "__main__":
    run(find)
