"""What a piece of work costs: processor time and its noise, memory, and how it grows with the size of the problem."""

from __future__ import annotations

import math
import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

POWERS = {"constant": lambda n: 0.0 * n, "log N": lambda n: np.log(np.log(n + 2.0)), "N": np.log,
          "N log N": lambda n: np.log(n * np.log(n + 2.0)), "N^2": lambda n: 2.0 * np.log(n),
          "N^2 log N": lambda n: np.log(n * n * np.log(n + 2.0)), "N^3": lambda n: 3.0 * np.log(n)}
"""Logarithms of the ways in which work is known to grow."""

LONG = 2e3
"""Time (ms) beyond which noise does not matter."""


@dataclass(frozen=True)
class Measured:
    """One method on one design. Times in ms of the processor, `spread` the middle run over the best, memory in MB.

    `error` is relative, against a reference that is not the method's own; `bound` is what is stated for it.
    """

    quantity: str
    method: str
    design: str
    milliseconds: float
    spread: float
    megabytes: float
    error: float
    bound: float = math.nan


@dataclass(frozen=True)
class Growth:
    """Times (ms) over a number of turns, layers or coils. The exponent and its name are those of the upper half."""

    what: str
    over: str
    numbers: tuple[float, ...]
    milliseconds: tuple[float, ...]
    megabytes: tuple[float, ...] = field(default=())

    def _upper(self) -> tuple[np.ndarray, np.ndarray]:
        first = (len(self.numbers) - 1) // 2
        return np.array(self.numbers[first:]), np.log(self.milliseconds[first:])

    @property
    def exponent(self) -> float:
        """Slope of the logarithm of time over that of the number."""
        numbers, times = self._upper()
        return float(np.polyfit(np.log(numbers), times, 1)[0])

    @property
    def name(self) -> str:
        """Which known way of growing lies nearest to the times, each with the best constant."""
        numbers, times = self._upper()
        left = {name: np.var(times - power(numbers)) for name, power in POWERS.items()}
        return min(left, key=lambda name: left[name])


def timed(work: Callable[[], object], runs: int = 3) -> tuple[float, float]:
    """Best processor time (ms) of warm runs, and the middle one over it; work of seconds is run once more only."""
    if _once(work) > LONG:
        runs = 1
    spent = [_once(work) for _ in range(runs)]
    return min(spent), statistics.median(spent) / max(min(spent), 1e-6)


def _once(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return 1e3 * (time.process_time() - began)


def peak(work: Callable[[], object]) -> float:
    """Most memory (MB) that a run holds at a time beyond what was there."""
    tracemalloc.start()
    work()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most / 1e6


def growth(what: str, over: str, works: Iterable[tuple[float, Callable[[], object]]]) -> Growth:
    """Time and memory of works by their numbers."""
    rows = [(float(number), timed(work, 2)[0], peak(work)) for number, work in works]
    return Growth(what, over, *(tuple(column) for column in zip(*rows, strict=True)))


def noise(runs: int = 15) -> tuple[float, float]:
    """Middle and largest time of one fixed piece of work over its best: what the machine adds to a time."""
    x = np.linspace(0.1, 1.0, 400_000)
    spent = []
    for _ in range(runs):
        began = time.process_time()
        np.sum(np.arcsinh(x) / np.sqrt(x))
        spent.append(time.process_time() - began)
    return statistics.median(spent) / min(spent), max(spent) / min(spent)
