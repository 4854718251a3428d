"""Files of the lab as values: measurement files as frames, models as dataclasses."""

from __future__ import annotations

import tempfile
import tomllib
import warnings
from dataclasses import dataclass, field
from html import escape
from io import StringIO
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from .lab import Path as AnyPath
from .processes import run_tool

if TYPE_CHECKING:
    import pandas

#: The end of a column's name, what it becomes, and by what its numbers are multiplied.
_SI = (("_um", "_m", 1e-6), ("_deg", "_rad", np.pi / 180))


def session(*paths: AnyPath) -> pandas.DataFrame:
    """Measurement files, and folders with all ``.csv`` files in them, as one frame in SI units.

    It is indexed by file and ``t_s``, with the columns of the files (``V1_V``, ``I1_A``, ``z_m``, ``tilt_x_rad``; NaN where one
    has no such column). ``frame.attrs["keys"]`` has the keys at the top of each file, as ``experiment``. A file that was cut
    short is read as far as it goes, with a warning.

    Raises:
        OSError: where one cannot be read.
        ValueError: where there is no file, or one is no table.
    """
    import pandas

    files: list[Path] = []
    for path in map(Path, paths):
        files += sorted(path.glob("*.csv")) if path.is_dir() else [path]
    if not files:
        raise ValueError(f"there is no .csv file in {', '.join(map(str, paths)) or 'nothing'}")
    read = {str(file): _read(file) for file in files}
    frame = pandas.concat({name: rows for name, (rows, _) in read.items()}, names=["file"])
    frame.attrs["keys"] = {name: keys for name, (_, keys) in read.items()}
    return frame


def _read(file: Path) -> tuple[pandas.DataFrame, dict[str, str]]:
    import pandas

    text = file.read_text()
    said = (line[1:].partition("=") for line in text.splitlines() if line.startswith("#"))
    keys = {key.strip(): value.strip() for key, _, value in said}
    if keys.pop("ends_with", None) == "rows" and keys.pop("rows", None) is None:
        warnings.warn(f"{file} is not whole: it was cut short", stacklevel=3)
        text = text[: text.rfind("\n") + 1]
    try:
        rows = pandas.read_csv(StringIO(text), comment="#").set_index("t_s")
    except (KeyError, ValueError) as error:
        raise ValueError(f"{file} is no measurement file: {error}") from None
    for old, new, factor in _SI:
        ours = [name for name in rows.columns if name.endswith(old)]
        rows[ours] *= factor
        rows = rows.rename(columns={name: name.removesuffix(old) + new for name in ours})
    return rows, keys


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model, in the unit of its file."""

    value: float
    unit: str
    #: ``None`` where it was not fitted.
    standard_error: float | None = None
    #: Of each actuator, where they are told apart; shape (4,).
    actuators: tuple[float, ...] = ()


@dataclass(frozen=True)
class Model:
    """A model file: what it says beyond the preset that it starts from."""

    preset: str
    #: By symbol, as ``R_T``; those of the preset are not among them.
    parameters: dict[str, Parameter] = field(default_factory=dict)
    #: The names of the effects in it.
    effects: tuple[str, ...] = ()
    #: What it was fitted to, as the file says.
    provenance: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, path: AnyPath) -> Self:
        """From a file.

        Raises:
            OSError: where it cannot be read.
            ValueError: where it is no model.
        """
        with open(path, "rb") as file:
            said = tomllib.load(file)
        try:
            named = {symbol: _parameter(one) for symbol, one in said.get("parameters", {}).items()}
            effects = tuple(str(effect["id"]) for effect in said.get("effects", []))
            return cls(said["preset"], named, effects, said.get("provenance", {}))
        except (KeyError, TypeError) as error:
            raise ValueError(f"{fspath(path)} is no model file: {error!r} is missing or wrong") from None

    def _repr_html_(self) -> str:
        rows = (
            f"<tr><td>{escape(symbol)}</td><td>{one.value:.5g}</td><td>{_digits(one.standard_error)}</td><td>{escape(one.unit)}</td></tr>"
            for symbol, one in self.parameters.items()
        )
        head = "<tr><th>parameter</th><th>value</th><th>standard error</th><th>unit</th></tr>"
        effects = escape(", ".join(self.effects)) or "no effect"
        return f"<p>{escape(self.preset)}, with {effects}</p><table>{head}{''.join(rows)}</table>"


def _digits(error: float | None) -> str:
    return "" if error is None else f"{error:.2g}"


def _parameter(said: dict[str, Any]) -> Parameter:
    return Parameter(
        float(said["value"]),
        str(said.get("unit", "1")),
        said.get("standard_error"),
        tuple(map(float, said.get("actuators", ()))),
    )


def fit(model: AnyPath, *measurements: AnyPath, output: AnyPath | None = None) -> Model:
    """``model``, a file or a preset, fitted to these measurement files or folders; kept in the file ``output``, if there is one.

    Raises:
        ToolError: where one cannot be used, or ``output`` is there already.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = fspath(output or Path(folder, "fitted.toml"))
        run_tool("fit", *(fspath(path) for path in (model, *measurements)), "-o", file)
        return Model.load(file)
