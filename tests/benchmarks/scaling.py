"""How studies go with the number of workers: measured here with one and two processes, simulated beyond.

    python tests/benchmarks/scaling.py [--designs 64] [--screen MILLISECONDS]

Measured are what the parent does of each design by itself (its key, its line of the archive, reading that back), the
bytes of a design to a worker and back, what a worker takes for one, and how long a batch takes with one and with two.
Simulated is the same queue as `study.evaluating.Workers` keeps, with more workers than anybody has here: tasks handed
out in order, two a worker at a time, each of about a second's work, results taken in order by a parent that does one
thing at a time. `--screen` simulates with another time of a design than the one measured.
"""

from __future__ import annotations

import argparse
import heapq
import os
import pickle
import random
import time
from collections import deque
from contextlib import suppress
from itertools import islice
from pathlib import Path
from statistics import mean

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sitscad
from sitscad.apps.study.evaluating import MOST_IN_CHUNK, SECONDS, Chunk, Workers
from sitscad.apps.study.evaluation import Archive
from sitscad.apps.study.running import GENERATION, POPULATION, LevelTally, sobol_set

ROOT = Path(__file__).resolve().parents[2]
A_TASK, BYTES_A_SECOND = 1e-3, 1.25e8
"""Assumed, not measured: what a scheduler of Dask takes for a task (its documentation says 1 ms), and a link of
1 Gbit/s of the parent.
"""

RUNS = (("a set drawn at once", 100_000, 100_000), ("as it is: sets in parts", 100_000, GENERATION),
        ("as it is: NSGA-II", 20_000, POPULATION))


def simulated(
    workers: int, designs: int, generation: int, screen: float, parent: float, sizes: tuple[float, ...]
) -> float:
    """Seconds that so many designs take in generations of which each is known before the next one is drawn."""
    there, back, text = sizes
    chance, clock, free = random.Random(1), 0.0, [0.0] * workers
    for begun in range(0, designs, generation):
        left = min(generation, designs - begun)
        running: deque[tuple[float, int]] = deque()  # when a task is ready, and how many designs it has
        while left or running:
            while left and len(running) < 2 * workers:
                size = min(max(1, min(MOST_IN_CHUNK, round(SECONDS / screen))), -(-left // workers))
                left -= size
                clock += A_TASK + (text + size * there) / BYTES_A_SECOND
                work = size * screen * mean(chance.uniform(0.6, 1.4) for _ in range(min(size, 8)))
                done = max(clock, heapq.heappop(free)) + work
                heapq.heappush(free, done)
                running.append((done, size))
            done, size = running.popleft()
            clock = max(clock, done) + size * (parent + back / BYTES_A_SECOND)
    return clock


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--designs", type=int, default=64)
    parser.add_argument("--screen", type=float, help="milliseconds of a design, in place of the measured ones")
    request = parser.parse_args()
    study = sitscad.Study.load(ROOT / "templates/studies/jaw_5mm.yaml")
    base, measures = study.request.base, study.request.measures
    points = list(islice(sobol_set(study.request.space, 4 * request.designs, 1), request.designs))
    designs = [study.request.space.changes(point) for point in points]
    evaluations, times = [], {}
    for jobs in (1, 2):
        with Workers(base, jobs) as workers:
            list(workers.evaluations(designs[:8], measures, "screen"))  # begins the processes, and warms them
            before, clock = _processor(), time.perf_counter()
            evaluations = list(workers.evaluations(designs, measures, "screen"))
            times[jobs] = time.perf_counter() - clock, _processor() - before
    screen = times[1][1] / len(designs)
    archive, tally, began = Archive(), LevelTally(study.request, "screen", 0, lambda state: None), time.process_time()
    for changes, item in zip(designs, evaluations, strict=True):
        key = base.key(changes, "screen")
        archive.add(key, changes, item.as_json())
        archive.evaluation(key, measures)
        tally.count_evaluation(item, is_made=True)
    parent = (time.process_time() - began) / len(designs)
    chunk, text = Chunk(tuple(designs), measures, "screen"), float(len(base.text))
    there, back = (len(pickle.dumps(each)) / len(designs) for each in (chunk, evaluations))
    for jobs, (clock, processor) in times.items():
        print(f"{jobs} workers: {len(designs)} designs in {clock:.1f} s by the clock, {processor:.1f} s of processor")
    print(f"a design: {1e3 * screen:.1f} ms of a worker, {1e3 * parent:.2f} ms of the parent, {there:.0f} bytes there "
          f"and {back:.0f} back; a task brings {text:.0f} bytes of the base; load {os.getloadavg()[0]:.1f}")
    screen = screen if request.screen is None else 1e-3 * request.screen
    print(f"simulated with {1e3 * screen:.1f} ms a design: seconds (share of what so many workers could do)")
    print("| workers |", " | ".join(f"{name}, {count} designs" for name, count, _ in RUNS), "|")
    for workers in (1, 2, 10, 100, 1000, 10_000):
        cells = []
        for _, count, part in RUNS:
            taken = simulated(workers, count, part, screen, parent, (there, back, text))
            cells.append(f"{taken:.0f} s ({count * screen / workers / taken:.0%})")
        print(f"| {workers} |", " | ".join(cells), "|")


def _processor() -> float:
    """Seconds of processor of this process and of those below it that are alive (Linux)."""
    parent, taken = {}, {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            fields = path.read_text().rpartition(")")[2].split()
            parent[int(path.parent.name)], taken[int(path.parent.name)] = int(fields[1]), sum(map(int, fields[11:13]))
    own, total = os.getpid(), 0.0
    for process in taken:
        above: int | None = process
        while above not in (own, None):
            above = parent.get(above)
        total += taken[process] if above == own else 0.0
    return total / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
