"""What arrays of numpy hold, for signatures (shapes are said where they matter), and parts of long ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Index = NDArray[np.intp]
Flags = NDArray[np.bool_]


def slices(count: int, size: int) -> list[slice]:
    """Parts of `count` rows, `size` each (one at least) and the last one what is left: what is worked on at once."""
    size = max(1, size)
    return [slice(low, min(low + size, count)) for low in range(0, count, size)]
