"""The connection, against a socket that answers what a test says."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from electrothermal_mirror import Instrument, InstrumentError

NO_ERROR = b'0,"No error"\n'


@contextmanager
def answering(*answers: bytes) -> Iterator[Instrument]:
    """An instrument that answers every exchange, of a message and the question for errors, with the next of these."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            client, _ = server.accept()
            with client, client.makefile("rb") as lines:
                for answer in answers:
                    lines.readline(), lines.readline()
                    client.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with Instrument(*server.getsockname()) as instrument:
            yield instrument
        thread.join()


def test_an_answer_is_returned_and_an_error_raised_where_it_was_caused() -> None:
    with answering(b"1,2,9.91E37\n" + NO_ERROR, b'-222,"Data ""out""; of range"\n', NO_ERROR) as instrument:
        one, two, unknown = instrument.query_numbers("X?")
        assert (one, two) == (1, 2) and unknown != unknown
        with pytest.raises(InstrumentError, match='Data "out"; of range') as raised:
            instrument.query("X?")
        assert raised.value.number == -222
        instrument.write("X")


def test_an_error_of_a_command_is_raised() -> None:
    with answering(b'-113,"Undefined header"\n') as instrument, pytest.raises(InstrumentError):
        instrument.write("X")


@pytest.mark.parametrize("block", [b"", b"\n#0;,", bytes(range(256)) * 300])
def test_a_block_comes_as_it_is(block: bytes) -> None:
    length = str(len(block)).encode()
    answer = b"#%d%s%s\n" % (len(length), length, block)
    with answering(answer + NO_ERROR) as instrument:
        assert instrument.query_block("X?") == block


def test_an_error_in_the_place_of_a_block_is_raised() -> None:
    with answering(b'-222,"Data out of range"\n') as instrument, pytest.raises(InstrumentError):
        instrument.query_block("X?")


def test_an_end_in_the_midst_of_an_answer_is_said() -> None:
    with answering(b"#210abc") as instrument, pytest.raises(ConnectionError):
        instrument.query_block("X?")


def test_what_is_asked_after_the_end_is_told_that_it_was_closed() -> None:
    with answering() as instrument:
        instrument.close()
        for ask in (instrument.write, instrument.query, instrument.query_block):
            with pytest.raises(ConnectionError, match="was closed"):
                ask("X?")


def test_two_lines_are_not_one_message() -> None:
    with answering() as instrument, pytest.raises(ValueError, match="one line"):
        instrument.write("*RST\n*RST")
