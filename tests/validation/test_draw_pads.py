"""The picture of the pad's law in the docs: how many load cases it shows, and that the page says so."""

from __future__ import annotations

import numpy as np
from draw_pads import KINDS, PICTURE, off, pads

PAGE = PICTURE.with_name("accuracy.md").read_text(encoding="utf-8")


def test_pad_force_errors_stay_within_percentiles_of_page():
    known = list(pads())
    errors = {words: np.concatenate([off(pad, rows) for pad, rows in known if kind(pad)])
              for words, kind in KINDS.items()}
    count = sum(map(len, errors.values()))
    assert count >= 60 and f"({PICTURE.name})" in PAGE
    assert f"{count} load cases of {len(known)} pads" in PAGE
    for words, share in (("bare", 0.05), ("smaller target than pad", 0.05), ("in a film", 0.07)):
        assert np.quantile(errors[words], 0.95) < share + 0.005, words
