"""The data set as arrays: sessions, the intervals that a simulation runs over, and which rows are held out."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ACTUATORS = 4
# Rows in a row that are fitted to, and then as many that are held out (the data set's README).
BLOCK = 5


@dataclass
class Session:
    """Rows of all files in the order of time, and the intervals before and between them.

    `volts` (rows, 4), `amperes` (rows, 4), `z_um`, `t_s` and `held_out` (rows); `kind` (rows) numbers the files.
    `duration_s`, `from_v` and `to_v` (intervals, 4) are the drive, `row` is the row read at an interval's end, or -1.
    """

    id: str
    noise_um: float
    volts: np.ndarray
    amperes: np.ndarray
    z_um: np.ndarray
    t_s: np.ndarray
    kind: np.ndarray
    held_out: np.ndarray
    duration_s: np.ndarray
    from_v: np.ndarray
    to_v: np.ndarray
    row: np.ndarray


def manifest(data: Path) -> list[dict]:
    """The lines of the manifest."""
    with open(data / "manifest.csv", newline="") as file:
        return list(csv.DictReader(file))


def train_answers(data: Path) -> dict[str, list[str]]:
    """What is hidden in each session of `train`."""
    with open(data / "answers-train.csv", newline="") as file:
        return {line["id"]: line["hidden"].split() for line in csv.DictReader(file)}


def stages(data: Path) -> dict[str, str]:
    """The stage of each candidate."""
    with open(data / "effects.csv", newline="") as file:
        return {line["id"]: line["stage"] for line in csv.DictReader(file)}


def read(data: Path, line: dict) -> Session:
    """One session of the manifest."""
    files = [_file(path) for path in sorted((data / "sessions" / line["id"]).glob("*.csv"))]
    files.sort(key=lambda file: file[1]["t_global_s"][0])
    drive, rows = [], []
    now_s = 0.0
    for kind, (keys, columns) in enumerate(files):
        volts = np.stack([columns[f"V{k}_V"] for k in range(1, ACTUATORS + 1)], axis=1)
        start_s = columns["t_global_s"][0] - columns["t_s"][0]
        prehold_s = float(keys.get("prehold_s", 0.0))
        prehold_v = float(keys.get("prehold_V", 0.0)) if prehold_s > 0.0 else 0.0
        rest_s = start_s - prehold_s - now_s
        if rest_s > 1e-9:
            drive.append((rest_s, np.zeros(ACTUATORS), np.zeros(ACTUATORS), -1))
        if prehold_s > 0.0:
            held = np.full(ACTUATORS, prehold_v)
            drive.append((prehold_s, held, held, -1))
        straight = "sin" in keys.get("drive", "")
        before_v, before_s = np.full(ACTUATORS, prehold_v), 0.0
        for index, (to_v, t_s) in enumerate(zip(volts, columns["t_s"])):
            from_v = before_v if straight else to_v
            drive.append((t_s - before_s, from_v, to_v, len(rows)))
            held_out = index // BLOCK % 2 == 1
            currents = [columns[f"I{k}_A"][index] for k in range(1, ACTUATORS + 1)]
            rows.append((to_v, currents, columns["z_um"][index], start_s + t_s, kind, held_out))
            before_v, before_s = to_v, t_s
        now_s = start_s + before_s
    duration_s, from_v, to_v, row = (np.array(column) for column in zip(*drive))
    volts, amperes, z_um, t_s, kind, held_out = (np.array(column) for column in zip(*rows))
    noise_um = 1e-3 * float(line["noise_z_nm"])
    return Session(
        line["id"], noise_um, volts, amperes, z_um, t_s, kind, held_out, duration_s, from_v, to_v, row
    )


def _file(path: Path) -> tuple[dict, dict]:
    keys, rows = {}, []
    with open(path, newline="") as file:
        for line in file:
            if line.startswith("#"):
                key, _, value = line[1:].strip().partition("=")
                keys[key] = value
            else:
                rows.append(line)
    table = list(csv.DictReader(rows))
    columns = {name: np.array([float(line[name]) for line in table]) for name in table[0]}
    return keys, columns
