"""A study while it is edited: the set with which its search begins, by the screen, told as it fills up."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

from sitscad.study.answer import passing
from sitscad.study.answer_tables import keys_words
from sitscad.study.evaluating import Workers
from sitscad.study.evaluation import SCREEN, Evaluation
from sitscad.study.running import Found
from sitscad.study.search import first_set
from sitscad.study.study import Study
from sitscad.study.sweeping import shown

PAUSE = 1.0
"""Seconds between two events of a sweep."""


def filling(study: Study, evaluated: dict[str, Evaluation], serves: bool) -> Iterator[tuple[dict[str, Any], bytes]]:
    """The numbers, and the page where it `serves` one, again and again until all designs were looked at. Those of saves
    before are taken from `evaluated`, as far as they still fit.
    """
    asked = study.asked
    points = first_set(asked.space, asked.evaluations, asked.seed, [asked.base_point])
    found = Found(asked, SCREEN)
    last = 0.0
    with Workers(asked.base, 1) as workers:
        for k, point in enumerate(points, 1):
            changes = asked.space.changes(point)
            key = f"{asked.base.key(changes, SCREEN)} {asked.measures}"
            if key not in evaluated:
                evaluated[key] = next(workers.evaluations([changes], asked.measures, SCREEN))
            found.screened[point] = evaluated[key]
            if time.perf_counter() - last > PAUSE or k == len(points):
                page = _page(study, found, len(points)) if serves else b""
                yield numbers(found, len(points)), page
                last = time.perf_counter()


def numbers(found: Found, of: int) -> dict[str, Any]:
    """How many designs were looked at, how many keep everything by the screen, and of these the best of each goal."""
    asked, good = found.asked, passing(found.asked, found.screened)
    said = {"designs": f"{len(found.screened)} of {of}", "keep everything": str(len(good))}
    for goal in asked.goals:
        known = (point for point in good if goal.measure in found.screened[point].values)
        values = {point: found.screened[point].values[goal.measure][0] for point in known}
        if values:
            best = min(values, key=lambda point: goal.cost(values[point]))
            said[goal.words] = f"{shown(goal.measure, values[best])} with {keys_words(asked.space.chosen(best))}"
    return said


def _page(study: Study, found: Found, of: int) -> bytes:
    from sitscad.study.page import page_so_far

    return page_so_far(study, found, of).encode()
