"""Model and measurements: what ``host-tool compare`` and ``host-tool diagnose`` find, as values."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from os import PathLike, fspath
from typing import Any, Literal

from .processes import run_tool

Path = str | PathLike[str]


@dataclass(frozen=True)
class ExperimentError:
    """By how much a model is off in one experiment, in the unit of the comparison."""

    experiment: str
    rms: float
    largest: float
    #: The drive at which it is largest (V), where that is known.
    largest_at: float | None


@dataclass(frozen=True)
class Comparison:
    """Where a model fails."""

    #: The unit of the errors, as ``um``: of what was measured.
    unit: str
    #: Over all rows.
    rms: float
    experiments: tuple[ExperimentError, ...]
    #: The same in words.
    sentences: tuple[str, ...]

    def _repr_html_(self) -> str:
        rows = (
            f"<tr><td>{escape(one.experiment)}</td><td>{one.rms:.3g}</td><td>{one.largest:+.3g}</td></tr>"
            for one in self.experiments
        )
        said = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.sentences)
        head = f"<tr><th>experiment</th><th>rms, {escape(self.unit)}</th><th>largest</th></tr>"
        return f"<table>{head}{''.join(rows)}</table><ul>{said}</ul>"


@dataclass(frozen=True)
class RankedEffect:
    """A candidate, and how well it explains what is left."""

    effect: str
    score: float
    #: The score above which mirrors that lack nothing hardly come.
    threshold: float
    #: Its share of the evidence among the effects above their thresholds and their rivals, 0 to 1.
    weight: float
    #: What speaks for it or against it, in words.
    why: str | None


@dataclass(frozen=True)
class Diagnosis:
    """Which physical effect a model lacks, or that the data cannot tell."""

    verdict: Literal["named", "ambiguous", "unknown", "none"]
    #: What is named, or what the data cannot tell apart.
    effects: tuple[str, ...]
    #: The best first.
    ranking: tuple[RankedEffect, ...]

    def _repr_html_(self) -> str:
        rows = (
            f"<tr><td>{escape(one.effect)}</td><td>{one.score:.1f}</td><td>{one.weight:.2f}</td></tr>"
            for one in self.ranking[:5]
        )
        head = "<tr><th>effect</th><th>score</th><th>weight</th></tr>"
        named = escape(", ".join(self.effects)) or "no effect"
        return f"<p>{self.verdict}: {named}</p><table>{head}{''.join(rows)}</table>"


def compare(model: Path, *measurements: Path) -> Comparison:
    """Where ``model``, a file or a preset, fails on these measurement files or folders.

    Raises:
        ToolError: where one cannot be used.
    """
    said = run_tool("compare", *(fspath(path) for path in (model, *measurements)))
    experiments = tuple(
        ExperimentError(one["experiment"], one["rms"], one["largest"], one.get("largest_at_v"))
        for one in said["experiments"]
    )
    return Comparison(said["unit"], said["rms"], experiments, tuple(said["sentences"]))


def diagnose(model: Path, *measurements: Path) -> Diagnosis:
    """Which physical effect ``model`` lacks, by these measurement files or folders.

    Raises:
        ToolError: where one cannot be used.
    """
    said = run_tool("diagnose", *(fspath(path) for path in (model, *measurements)))
    return Diagnosis(said["verdict"], tuple(map(_name, said["effects"])), tuple(map(_ranked, said["ranking"])))


def _name(effect: Any) -> str:
    return str(effect["effect"] if isinstance(effect, dict) else effect)


def _ranked(one: Any) -> RankedEffect:
    return RankedEffect(one["effect"], one["score"], one["threshold"], one["weight"], one.get("why"))
