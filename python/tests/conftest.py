"""One emulated board for all tests, with the real tool and the real firmware."""

from collections.abc import Iterator

import pytest
from electrothermal_mirror import EmulatedBoard, Mirror, Server


@pytest.fixture(scope="session")
def served() -> Iterator[Server]:
    with EmulatedBoard() as board, Server(board.name, board.boards) as server:
        yield server


@pytest.fixture
def mirror(served: Server) -> Iterator[Mirror]:
    with Mirror(*served.address) as mirror:
        yield mirror
