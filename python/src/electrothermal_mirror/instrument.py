"""A SCPI instrument on a TCP socket: commands, queries, blocks, and errors as exceptions."""

from __future__ import annotations

import re
import socket
import threading
from types import TracebackType

#: The port that SCPI on a socket has by convention, and ``host-tool serve`` unless told otherwise.
PORT = 5025

#: What stands for a number that is not known (SCPI-1999, 7.2.1.5).
NOT_A_NUMBER = 9.91e37

_ERROR = re.compile(r'([-+]?\d+),"((?:[^"]|"")*)"')


class InstrumentError(Exception):
    """What the instrument says went wrong, with what to do next."""

    def __init__(self, number: int, text: str) -> None:
        super().__init__(f"{text} ({number})")
        #: SCPI's number of it, below zero.
        self.number = number


def error_in(answer: str) -> InstrumentError | None:
    """The error that ``answer`` tells, where it answers ``SYSTem:ERRor?``; its number is 0 where nothing went wrong."""
    error = _ERROR.fullmatch(answer)
    return InstrumentError(int(error[1]), error[2].replace('""', '"')) if error else None


def known(number: float) -> float:
    """``number`` as the instrument says it; NaN where it is not known."""
    return float("nan") if number == NOT_A_NUMBER else number


class Instrument:
    """A connection to ``host-tool serve``. Threads may share it.

    Every exchange asks for the instrument's errors in the same breath, so a failure is raised where it was caused.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = PORT, timeout: float = 30.0) -> None:
        """Connects. ``timeout`` (s) is for connecting, and for each answer beyond the time that was asked to wait.

        Raises:
            OSError: where nobody listens there.
        """
        self._timeout = timeout
        self._socket = socket.create_connection((host, port), timeout)
        # A query is one short packet, which is not to wait for more to come.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = self._socket.makefile("rb")
        self._turn = threading.Lock()
        self._is_closed = False

    def __enter__(self) -> Instrument:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection: what it drives is off then. Whatever is asked later raises a ``ConnectionError``."""
        self._is_closed = True
        self._reader.close()
        self._socket.close()

    def write(self, command: str) -> None:
        """Says something that is not answered.

        Raises:
            InstrumentError: where it was not carried out, or something went wrong since the last exchange.
        """
        with self._turn:
            self._send(command)
            self._check()

    def query(self, question: str, wait: float = 0.0) -> str:
        """The answer to ``question``, which may take ``wait`` seconds longer than a query does.

        Raises:
            InstrumentError: where there is none, or something went wrong since the last exchange.
        """
        with self._turn:
            self._send(question, wait)
            answer = self._line()
            error = error_in(answer)
            if error:
                raise error
            self._check()
            return answer

    def query_numbers(self, question: str) -> list[float]:
        """The numbers that answer ``question``; NaN where one is not known.

        Raises:
            InstrumentError: as of :meth:`query`.
        """
        return [known(float(number)) for number in self.query(question).split(",")]

    def query_block(self, question: str, wait: float = 0.0) -> bytes:
        """The block of bytes that answers ``question`` (IEEE 488.2, 8.7.9).

        Raises:
            InstrumentError: as of :meth:`query`.
        """
        with self._turn:
            self._send(question, wait)
            first = self._read(1)
            if first != b"#":
                error = error_in((first + self._reader.readline()).decode().strip())
                raise error or ValueError(f"{question} is not answered by a block")
            digits = int(self._read(1))
            block = self._read(int(self._read(digits)))
            self._line()
            self._check()
            return block

    def _send(self, message: str, wait: float = 0.0) -> None:
        if "\n" in message:
            raise ValueError("one line at a time")
        if self._is_closed:
            raise ConnectionError("this connection was closed, by close() or at the end of its `with`; connect anew")
        self._socket.settimeout(self._timeout + wait)
        # The question for errors is a line of its own: it is answered even where nothing else is.
        self._socket.sendall(f"{message}\nSYST:ERR?\n".encode())

    def _check(self) -> None:
        error = error_in(self._line())
        if error and error.number != 0:
            raise error

    def _line(self) -> str:
        line = self._reader.readline()
        if not line.endswith(b"\n"):
            raise ConnectionError("the instrument has closed the connection; is `host-tool serve` still there?")
        return line.decode().rstrip("\r\n")

    def _read(self, count: int) -> bytes:
        read = self._reader.read(count)
        if read is None or len(read) < count:
            raise ConnectionError("the instrument has closed the connection in the midst of an answer")
        return read
