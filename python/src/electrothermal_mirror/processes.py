"""Processes that this package starts: ``host-tool serve``, and an emulated board. They end with it, however it ends."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Self


class ToolError(Exception):
    """``host-tool`` could not do what it was asked: what happened, and what to do next."""


def tool() -> str:
    """The path of ``host-tool``: what ``MIRROR_HOST_TOOL`` says, or what ``PATH`` leads to.

    Raises:
        ToolError: where there is none.
    """
    path = os.environ.get("MIRROR_HOST_TOOL") or shutil.which("host-tool")
    if path is None:
        raise ToolError(
            "host-tool was not found; install it with `cargo install --path host-tool` from its sources, "
            "or set MIRROR_HOST_TOOL to its path"
        )
    return path


def run_tool(*words: str) -> Any:
    """What ``host-tool WORDS --json`` reports.

    Raises:
        ToolError: where it fails.
    """
    done = subprocess.run([tool(), *words, "--json"], capture_output=True, text=True, check=False)
    try:
        report = json.loads(done.stdout)
    except json.JSONDecodeError:
        raise ToolError(done.stderr.strip() or "host-tool said nothing") from None
    if done.returncode != 0:
        error = report.get("error", {}) if isinstance(report, dict) else {}
        said = [error.get("message"), error.get("help")]
        raise ToolError(". ".join(text for text in said if text) or done.stderr.strip())
    return report


class _Process:
    """A process that ends when its standard input does, and so with this one, even when that is killed."""

    def __init__(self, words: list[str], environment: dict[str, str], folder: str | None = None) -> None:
        self.process = subprocess.Popen(
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=folder,
            env=os.environ | environment,
            # Ctrl-C in a notebook is for what runs there.
            start_new_session=True,
        )

    def line(self) -> str:
        """The next line of its output; empty once it has ended."""
        assert self.process.stdout is not None
        return self.process.stdout.readline()

    def close(self) -> None:
        """Ends it."""
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            self.process.stdin.close()
            self.process.wait(10)
        except (OSError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Server(_Process):
    """A ``host-tool serve`` of one's own, on a port that is free."""

    def __init__(self, board: str | None = None, boards: Path | None = None) -> None:
        """Starts it, for the board ``board`` by name, among those in the folder ``boards``.

        Raises:
            ToolError: where it does not start.
        """
        words = [tool(), "serve", "--listen", "127.0.0.1:0", "--end-with-input", "--json"]
        words += ["--board", board] if board else []
        environment = {"MIRROR_BOARDS": str(boards)} if boards else {}
        super().__init__(words, environment)
        line = self.line()
        if not line:
            self.close()
            raise ToolError("host-tool serve ended at once; what it said stands above")
        host, port = json.loads(line)["listening"].rsplit(":", 1)
        self.address = (str(host), int(port))


class EmulatedBoard(_Process):
    """The firmware on an emulated microcontroller, in front of a virtual mirror.

    It needs the project's sources: ``MIRROR_SOURCES`` says where they are, unless the working directory is within them.
    ``MIRROR_EMULATE`` is another command that starts one.
    """

    def __init__(self, name: str = "emulated") -> None:
        """Builds what is not built, and starts it.

        Raises:
            ToolError: where it does not start.
        """
        self._folder = tempfile.TemporaryDirectory(prefix="mirror-boards-")
        self.name = name
        #: Where ``host-tool`` finds it: the variable ``MIRROR_BOARDS``.
        self.boards = Path(self._folder.name)
        words = shlex.split(os.environ.get("MIRROR_EMULATE", "cargo xtask emulate"))
        environment = {"MIRROR_BOARDS": str(self.boards)}
        try:
            super().__init__([*words, "--name", name], environment, os.environ.get("MIRROR_SOURCES"))
        except OSError as error:
            self._folder.cleanup()
            raise ToolError(f"`{words[0]}` does not start: {error}; an emulated board needs cargo") from None
        said = ""
        while "The board is up" not in said:
            said = self.line()
            if not said:
                self.close()
                raise ToolError("the emulated board does not start; what it said stands above")

    def close(self) -> None:
        """Ends it."""
        super().close()
        self._folder.cleanup()
