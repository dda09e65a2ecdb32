"""Random tails and bodies in small: random_tails.py beside this has them in large."""

import pytest
from random_tails import PASSED, board, judged


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, *(pytest.param(n, marks=pytest.mark.more) for n in range(10, 60, 10))])
def test_a_board_that_passes_its_check_is_laid_out_inside_its_outline(first):
    assert PASSED in [judged(board(seed)) for seed in range(first, first + 10)]
