"""What every method does alike: takes its arguments, calibrates on `train`, and writes predictions."""

import argparse
import csv
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import session

COLUMNS = ["id", "verdict", "effects", "stage", "probability", "confidence", "rms_before_um", "rms_after_um", "seconds"]
# Penalty of the slope of the logistic curve: 1/2 of its square, so that few sessions give no certainty.
RIDGE = 1.0


@dataclass
class Finding:
    """What a method makes of one session, before its threshold: the larger the score, the more is missing.

    `effects` are those it would name, best first; none where it cannot name any. `confidence` is its own of the names. Errors are
    of the displacement on rows held out (um), without and with what it adds.
    """

    score: float
    effects: list[str]
    stage: str
    confidence: float
    rms_before_um: float
    rms_after_um: float
    # Of a method with a threshold of its own.
    verdict: str | None = None


def run(find: Callable[[session.Session, Path, Path], Finding]) -> None:
    """Lets a method find what it finds in every session, and writes its predictions.

    The threshold is the largest score of a session of `train` with nothing hidden; a probability is the logistic curve of the
    logarithm of scores that tells those of `train` apart [Platt 1999].
    """
    words = argparse.ArgumentParser()
    words.add_argument("data", type=Path)
    words.add_argument("predictions", type=Path)
    words.add_argument("--work", type=Path, required=True)
    words.add_argument("--budget", type=float, default=60.0, help="seconds a session; once all together are spent, the rest is left out")
    asked = words.parse_args()
    lines = session.manifest(asked.data)
    found, seconds = {}, {}
    begun = time.monotonic()
    for line in lines:
        if time.monotonic() - begun > asked.budget * len(lines):
            print(f"the time budget ends before {line['id']}", flush=True)
            break
        start = time.monotonic()
        try:
            finding = find(session.read(asked.data, line), asked.data, asked.work)
        except Exception as error:
            # Other people's code may fail in any way; the session stays without an answer, which the score tells.
            print(f"{line['id']}: {error}", flush=True)
            continue
        found[line["id"]] = finding
        seconds[line["id"]] = time.monotonic() - start
    hidden = session.train_answers(asked.data)
    train = [(finding.score, bool(hidden[id])) for id, finding in found.items() if id in hidden]
    threshold = max(score for score, is_hidden in train if not is_hidden)
    slope, offset = logistic([logarithm(score) for score, _ in train], [is_hidden for _, is_hidden in train])
    with open(asked.predictions, "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for line in lines:
            if line["split"] == "test" and line["id"] in found:
                finding = found[line["id"]]
                probability = 1.0 / (1.0 + np.exp(-(slope * logarithm(finding.score) + offset)))
                table.writerow(_row(line["id"], finding, threshold, probability, seconds[line["id"]]))


def _row(id, finding, threshold, probability, seconds):
    missing = "named" if finding.effects else "unknown"
    verdict = finding.verdict or (missing if finding.score > threshold else "none")
    is_missing = verdict != "none"
    after = finding.rms_after_um if is_missing else finding.rms_before_um
    return {
        "id": id,
        "verdict": verdict,
        "effects": " ".join(finding.effects) if verdict == "named" else "",
        "stage": finding.stage if is_missing else "",
        "probability": f"{probability:.4f}",
        "confidence": f"{finding.confidence:.4f}" if verdict == "named" else "",
        "rms_before_um": f"{finding.rms_before_um:.4f}",
        "rms_after_um": f"{after:.4f}",
        "seconds": f"{seconds:.2f}",
    }


def logarithm(score: float) -> float:
    """Of a score that is counted in hundreds or thousands, and may be below 0."""
    return float(np.log1p(max(score, 0.0)))


def logistic(scores: list[float], is_hidden: list[bool]) -> tuple[float, float]:
    """Slope and offset of the logistic curve through some scores, by Newton's method, with Platt's targets."""
    x, y = np.array(scores), np.array(is_hidden)
    target = np.where(y, (y.sum() + 1) / (y.sum() + 2), 1 / ((~y).sum() + 2))
    design = np.column_stack([x - x.mean(), np.ones_like(x)])
    at = np.zeros(2)
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-design @ at))
        slope = design.T @ (p - target) + [RIDGE * at[0], 0.0]
        bend = design.T @ (design * (p * (1.0 - p))[:, None]) + np.diag([RIDGE, 1e-9])
        at -= np.linalg.solve(bend, slope)
    return float(at[0]), float(at[1] - at[0] * x.mean())
