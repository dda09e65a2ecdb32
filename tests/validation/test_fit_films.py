"""The terms of films in `sitscad/data` are those that their script fits."""

from __future__ import annotations

from fit_films import fitted
from tolerance import approx

from sitscad.kernels.mechanics.surround_law import coefficient_table


def test_film_coefficients_are_reproduced_by_fit_script():
    for course, parts in coefficient_table().items():
        for term, values in fitted(course).items():
            assert parts[term] == approx(values, rel=1e-3, abs=2e-3), (course, term)
