"""Type names for numpy arrays in signatures, and slices that divide long arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Index = NDArray[np.intp]
Flags = NDArray[np.bool_]


def slices(count: int, size: int) -> list[slice]:
    """Return slices that divide `count` rows into parts of `size` rows. A `size` below 1 counts as 1.

    The last part may be shorter.
    """
    size = max(1, size)
    return [slice(low, min(low + size, count)) for low in range(0, count, size)]
