"""Every candidate fitted together with the base by lmfit, and ranked by Schwarz's criterion as lmfit computes it.

The score is by how much the best candidate lowers the BIC. Candidates whose BIC is within 10 of the best are named together: more
is very strong evidence [Kass and Raftery 1995]. The confidence is their share of the BIC weights.
"""

import numpy as np
from fits import all_fits, held_out_rms, predict
from session import stages
from verdict import Finding, run

ALIKE = 10.0


def find(session, data, work):
    base, *candidates = all_fits(session, work)
    candidates.sort(key=lambda fit: fit.bic)
    best = candidates[0]
    weights = np.exp(-0.5 * (np.array([fit.bic for fit in candidates]) - best.bic))
    alike = [fit for fit in candidates if fit.bic - best.bic < ALIKE]
    names = list(dict.fromkeys(fit.name for fit in alike))
    named = sum(weight for fit, weight in zip(candidates, weights) if fit.name in names)
    return Finding(
        score=base.bic - best.bic,
        effects=names,
        stage=stages(data)[best.name],
        confidence=named / weights.sum(),
        rms_before_um=held_out_rms(session, predict(session, base)[0]),
        rms_after_um=held_out_rms(session, predict(session, best)[0]),
    )


if __name__ == "__main__":
    run(find)
