#!/usr/bin/env python3
"""Scores predictions of what is hidden in the sessions of the split `test`: any method's, by the same rules.

    score.py DATA PREDICTIONS.csv [PREDICTIONS.csv ...]

A predictions file has a line a session: `id`; `verdict`, which is `none`, `named` or `unknown`; `effects`, the names of a verdict
`named`, best first; `stage` of the chain, for `named` and `unknown`, where the method tells one; `probability` that anything is
missing; `confidence`, the method's own probability that one of the names is right; `rms_before_um` and `rms_after_um`, errors of
the displacement on the rows held out; `seconds`. What may be empty: all but `id`, `verdict` and `probability`. A session without a
line counts as `none` with probability 1/2, and is told.
"""

import csv
import math
import statistics
import sys
from pathlib import Path

# The largest set of names that counts as a name.
SET = 2
BINS = 5


def lines(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


class Judged:
    """One session's truth beside its prediction."""

    def __init__(self, truth, prediction):
        self.is_answered = prediction is not None
        said = prediction or {"verdict": "none", "probability": "0.5"}
        self.hidden = truth["hidden"].split()
        self.listed = truth["effects"].split()
        self.stages = truth["stages"].split()
        self.is_shown = truth["shown"] == "yes"
        self.verdict = said["verdict"]
        if self.verdict not in ("none", "named", "unknown"):
            raise ValueError(f"{truth['id']}: a verdict is none, named or unknown, and not `{self.verdict}`")
        self.names = (said.get("effects") or "").split() if self.verdict == "named" else []
        if self.verdict == "named" and not self.names:
            raise ValueError(f"{truth['id']}: `named` without an effect")
        self.stage = (said.get("stage") or "") if self.verdict != "none" else ""
        self.probability = float(said["probability"])
        if not 0.0 <= self.probability <= 1.0:
            raise ValueError(f"{truth['id']}: a probability of {self.probability}")
        self.confidence = number(said.get("confidence"))
        self.before_um = number(said.get("rms_before_um"))
        self.after_um = number(said.get("rms_after_um"))
        self.seconds = number(said.get("seconds"))

    @property
    def is_single(self):
        """One effect of the list is hidden, and nothing else."""
        return len(self.hidden) == len(self.listed) == 1

    @property
    def holds_a_truth(self):
        return any(name in self.listed for name in self.names)

    @property
    def is_found(self):
        return len(self.names) <= SET and self.holds_a_truth


def number(text):
    return float(text) if text else None


def judged(truths, predictions):
    """Every session of the answers with its prediction.

    Raises ValueError where a prediction is of no session, or of one twice.
    """
    by_id = {}
    for prediction in predictions:
        if prediction["id"] in by_id:
            raise ValueError(f"{prediction['id']} is predicted twice")
        by_id[prediction["id"]] = prediction
    unknown = set(by_id) - {truth["id"] for truth in truths}
    if unknown:
        raise ValueError(f"no session of `test`: {' '.join(sorted(unknown))}")
    return [Judged(truth, by_id.get(truth["id"])) for truth in truths]


def figures(sessions):
    """The figures of one method, by name, as text."""
    hidden = [s for s in sessions if s.hidden]
    nothing = [s for s in sessions if not s.hidden]
    single = [s for s in hidden if s.is_single]
    alone = [s for s in hidden if len(s.hidden) == 1]
    unlisted = [s for s in alone if not s.listed]
    pairs = [s for s in hidden if len(s.hidden) == 2]
    named = [s for s in hidden if s.verdict == "named"]
    return {
        "answered": share(s.is_answered for s in sessions),
        "found: named, or in a set of two": share(s.is_found for s in single),
        "found, of what can be shown": share(s.is_found for s in single if s.is_shown),
        "anything hidden: said to be missing": share(s.verdict != "none" for s in hidden),
        "right stage, one effect hidden": share(s.stage in s.stages for s in alone),
        "a wrong name, anything hidden": share(not s.holds_a_truth if s.verdict == "named" else False for s in hidden),
        "nothing hidden: said to be missing": share(s.verdict != "none" for s in nothing),
        "not in the list: `unknown`": share(s.verdict == "unknown" for s in unlisted),
        "two hidden: one of them named": share(s.is_found for s in pairs),
        "Brier score of anything missing": text(brier((s.probability, bool(s.hidden)) for s in sessions)),
        "calibration error of it": text(calibration_error([(s.probability, bool(s.hidden)) for s in sessions])),
        "Brier score of the names": text(
            brier((s.confidence, s.holds_a_truth) for s in named if s.confidence is not None)
        ),
        "error after over before, anything hidden": text(median(ratio(s) for s in hidden)),
        "the same, nothing hidden": text(median(ratio(s) for s in nothing)),
        "error after, anything hidden (um)": text(median(s.after_um for s in hidden)),
        "seconds a session": text(median(s.seconds for s in sessions)),
    }


def share(yes):
    """How many of how many, as text."""
    yes = list(yes)
    return f"{100 * sum(yes) / len(yes):.0f} % ({sum(yes)} of {len(yes)})" if yes else "-"


def brier(pairs):
    """Mean square of probability less outcome [Brier 1950]; None of nothing."""
    squares = [(probability - outcome) ** 2 for probability, outcome in pairs]
    return sum(squares) / len(squares) if squares else None


def calibration_error(pairs):
    """Expected calibration error: |mean probability - frequency| of equally wide bins, weighed by their number."""
    bins = [[] for _ in range(BINS)]
    for probability, outcome in pairs:
        bins[min(int(BINS * probability), BINS - 1)].append((probability, outcome))
    off = 0.0
    for pairs_in_bin in filter(None, bins):
        probabilities, outcomes = zip(*pairs_in_bin)
        off += abs(sum(probabilities) - sum(outcomes))
    return off / len(pairs) if pairs else None


def ratio(session):
    if session.before_um is None or session.after_um is None or session.before_um <= 0.0:
        return None
    return session.after_um / session.before_um


def median(values):
    known = [value for value in values if value is not None and math.isfinite(value)]
    return statistics.median(known) if known else None


def text(value):
    return "-" if value is None else f"{value:.2f}"


def table(columns):
    """Markdown: a row a figure, a column a method."""
    names = list(columns)
    rows = [["figure", *names], ["---"] * (1 + len(names))]
    for figure in next(iter(columns.values())):
        rows.append([figure, *(columns[name][figure] for name in names)])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main(words):
    if len(words) < 2:
        sys.exit(__doc__)
    truths = lines(Path(words[0]) / "answers-test.csv")
    columns = {Path(path).stem: figures(judged(truths, lines(path))) for path in words[1:]}
    print(table(columns))


if __name__ == "__main__":
    main(sys.argv[1:])
