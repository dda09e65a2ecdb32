"""What arrays of numpy hold, for signatures; shapes are said where they matter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Index = NDArray[np.intp]
Flags = NDArray[np.bool_]
