"""Van Liempd 2023: coils of one to six layers, wound and measured; the data name the rows of its tables."""

from __future__ import annotations

import numpy as np
from published_coils import MEASURED, inductance


def test_inductance_agrees_with_25_measured_coils():
    errors = [abs(inductance(case) / (case["L_uH"] * 1e-6) - 1.0) for case in MEASURED]
    assert len(errors) == 25
    assert float(np.median(errors)) <= 0.006
    assert max(errors) <= 0.02
