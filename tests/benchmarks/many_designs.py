"""Memory and time of a study of very many designs, but for what judging them takes.

    python tests/benchmarks/many_designs.py [--designs 100000] [--method sobol] [--again]

Sixteen designs of the jaw study are screened; every other one is told as one of these, by its number, with figures
moved by a part of it. Search, archive, front, answer and page are a study's own. With `--again` the same study runs a
second time, in another process, from the archive alone. It prints the largest memory and where the time went; it fails
on nothing.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sitscad
from sitscad.apps.study.evaluating import Chunk, screen_designs
from sitscad.apps.study.evaluation import Evaluation
from sitscad.apps.study.page import answer_files

ROOT = Path(__file__).resolve().parents[2]
RECORDED = 16


class Told:
    """An executor that tells every design as one of those that were screened."""

    def __init__(self, rows: list[Evaluation]) -> None:
        self.rows = rows

    def submit(self, work: Callable[..., Any], /, *given: Any) -> Future[Any]:
        chunk: Chunk = given[1]
        future: Future[Any] = Future()
        future.set_result(([self.one(changes, chunk.level) for changes in chunk.designs], 1e-2))
        return future

    def one(self, changes: Any, level: str) -> Evaluation:
        number = zlib.crc32(repr(changes).encode())
        row, factor = self.rows[number % len(self.rows)], 1.0 + 0.1 * (number / 2**32 - 0.5)
        return replace(row, values={name: (factor * value, error) for name, (value, error) in row.values.items()},
                       level=level)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--designs", type=int, default=100_000)
    parser.add_argument("--method", default="sobol")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--again", action="store_true")
    request = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = request.folder or Path(temporary)
        run(folder, request.designs, request.method)
        if request.again:
            subprocess.run([sys.executable, __file__, "--designs", str(request.designs), "--method", request.method,
                            "--folder", folder], check=True)


def run(folder: Path, designs: int, method: str) -> None:
    text = (ROOT / "templates/studies/jaw_5mm.yaml").read_text()
    for old, new in (("evaluations: 300", f"evaluations: {designs}, method: {method}"), ("step: 0.05", "step: 0.02"),
                     ("from: 4.0, to: 5, step: 0.1", "from: 4.6, to: 5, step: 0.02"), ("to: 10,", "to: 8,"),
                     ("search:", "accept: all\nsearch:"), ("../", f"{ROOT}/templates/")):  # all can be wound
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "many.yaml"
    path.write_text(text)
    study = sitscad.Study.load(path)
    points = [tuple(k * (n - 1) // RECORDED for n in study.request.space.shape) for k in range(RECORDED)]
    specs = [study.request.base.changed_spec(study.request.space.changes(point)) for point in points]
    rows = screen_designs(specs, study.request.measures)
    print(f"begun with {_memory():.0f} MB")
    began, clock = time.process_time(), time.perf_counter()
    answer = study.run(Told(rows), folder=folder, jobs=1, draws=0)
    searched = time.process_time() - began
    files = answer_files(answer)
    print(f"{len(answer.results.screened)} designs, {len(answer.results.full)} in full, {len(answer.front)} on the "
          f"front, "
          f"{answer.results.reused} from the archive: {searched:.0f} s of processor, files "
          f"{time.process_time() - began - searched:.0f} s, {time.perf_counter() - clock:.0f} s by the clock; "
          f"archive {(folder / 'archive.jsonl').stat().st_size / 1e6:.0f} MB, "
          f"page {len(files['study.html']) / 1e3:.0f} kB, at most {_memory():.0f} MB")


def _memory() -> float:
    """The most that this process has held so far, in MB (Linux); what it was begun by does not count."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


if __name__ == "__main__":
    main()
