"""Processes that this package starts: ``host-tool serve``, and an emulated board. They end with it, however it ends."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sysconfig
import tempfile
from pathlib import Path
from typing import Any, Self


class ToolError(Exception):
    """``host-tool`` could not do what it was asked: what happened, and what to do next."""


def _program(name: str) -> str | None:
    """The path of a program: in the environment that this package was installed into with it, or on the ``PATH``."""
    return shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)


def tool() -> str:
    """The path of ``host-tool``: what ``MIRROR_HOST_TOOL`` says, that of this environment, or what ``PATH`` leads to.

    Raises:
        ToolError: where there is none.
    """
    path = os.environ.get("MIRROR_HOST_TOOL") or _program("host-tool")
    if path is None:
        raise ToolError(
            "host-tool was not found; install it with `cargo install --path host-tool` from its sources, "
            "or set MIRROR_HOST_TOOL to its path"
        )
    return path


def run_tool(*words: str, boards: Path | None = None) -> Any:
    """What ``host-tool WORDS --json`` reports, where it needs a board of one in the folder ``boards``.

    Raises:
        ToolError: where it fails.
    """
    done = subprocess.run(
        [tool(), *words, "--json"], capture_output=True, text=True, check=False, env=os.environ | _among(boards)
    )
    try:
        report = json.loads(done.stdout)
    except json.JSONDecodeError:
        raise ToolError(done.stderr.strip() or "host-tool said nothing") from None
    if done.returncode != 0:
        error = report.get("error", {}) if isinstance(report, dict) else {}
        said = [error.get("message"), error.get("help")]
        raise ToolError(". ".join(text for text in said if text) or done.stderr.strip())
    return report


def _among(boards: Path | None) -> dict[str, str]:
    """What tells the tool the folder of the boards."""
    return {"MIRROR_BOARDS": str(boards)} if boards else {}


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
        super().__init__(words, _among(boards))
        line = self.line()
        if not line:
            self.close()
            raise ToolError("host-tool serve ended at once; what it said stands above")
        host, port = json.loads(line)["listening"].rsplit(":", 1)
        self.address = (str(host), int(port))


class EmulatedBoard(_Process):
    """The firmware compiled for this machine, in front of a virtual mirror. It needs no QEMU.

    ``mirror-emulator`` is it, which is installed with the tool. Without that it is built from the project's sources:
    ``MIRROR_SOURCES`` says where they are, unless the working directory is within them. ``MIRROR_EMULATE`` is another command
    that starts one.
    """

    def __init__(self, name: str = "emulated", boards: Path | None = None, speed: int | None = None) -> None:
        """Builds what is not built, and starts it; in the folder ``boards`` with others, or in one of its own.

        Its clock goes ``speed`` times as fast as the wall's, 1 to 1000; without that as fast as it can while somebody is connected.

        Raises:
            ToolError: where it does not start.
        """
        self.name = name
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if boards is None:
            self._folder = tempfile.TemporaryDirectory(prefix="mirror-boards-")
            boards = Path(self._folder.name)
        #: Where ``host-tool`` finds it: the variable ``MIRROR_BOARDS``.
        self.boards = boards
        words = shlex.split(os.environ.get("MIRROR_EMULATE") or _program("mirror-emulator") or "cargo xtask emulate")
        words += ["--board", "host", "--name", name]
        words += ["--speed", str(speed)] if speed else []
        try:
            super().__init__(words, _among(self.boards), os.environ.get("MIRROR_SOURCES"))
        except OSError as error:
            self._tidy_up()
            raise ToolError(f"`{words[0]}` does not start: {error}; install the wheel with the tool in it, or cargo") from None
        said = ""
        while "The board is up" not in said:
            said = self.line()
            if not said:
                self.close()
                raise ToolError("the emulated board does not start; what it said stands above")

    def close(self) -> None:
        """Ends it."""
        super().close()
        self._tidy_up()

    def kill(self) -> None:
        """Ends it without a word, as a cable that is pulled."""
        self.process.kill()
        self.process.wait()

    def _tidy_up(self) -> None:
        if self._folder:
            self._folder.cleanup()
