"""Random tails and bodies in small: random_tails.py beside this has them in large."""

import pytest
from random_tails import PASSED, board, judged


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, *(pytest.param(n, marks=pytest.mark.more) for n in range(10, 60, 10))])
def test_random_boards_that_pass_check_lie_inside_their_outline(first):
    assert PASSED in [judged(board(seed)) for seed in range(first, first + 10)]
