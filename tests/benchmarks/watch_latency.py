"""How long after a save each stage of `sitscad watch` is told: median and longest over some saves of one kind each.

    python tests/benchmarks/watch_latency.py [TEMPLATE] [--saves 20]

A save waits for the last stage of the one before, so nothing is interrupted. It fails on nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from sitscad.finding import Edit  # noqa: E402
from sitscad.spec.yaml.rewriting import rewritten  # noqa: E402

KINDS = {
    "another scan rate": ("readout.scan_rate", "{:.1f} Hz", 400.0, 1.0),
    "another pad": ("elastomer.thickness", "{:.3f}", 0.62, 0.001),
    "another track": ("coil.trace_width", "{:.1f} um", 78.0, 0.1),
}
"""Saves: key, how its value is written, the first and the step."""


def main() -> None:
    """Print one row a kind and stage."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("template", nargs="?", default="grasper_4layer")
    parser.add_argument("--saves", type=int, default=20)
    asked = parser.parse_args()
    text = (ROOT / "templates" / f"{asked.template}.yaml").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "watched.yaml"
        path.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "sitscad", "watch", str(path), "--serve", "--format", "json"]
        around = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=around, cwd=ROOT)
        try:
            told(process, time.perf_counter())
            for kind, (key, written, first, step) in KINDS.items():
                spent: dict[str, list[float]] = {}
                for number in range(asked.saves):
                    changed = rewritten(text, [Edit(key, written.format(first + step * number))])
                    beside = path.with_suffix(".new")
                    beside.write_text(changed, encoding="utf-8")
                    began = time.perf_counter()
                    os.replace(beside, path)
                    for stage, seconds in told(process, began):
                        spent.setdefault(stage, []).append(seconds)
                for stage, seconds in spent.items():
                    print(f"{kind:20} {stage:10} {statistics.median(seconds):6.2f} s, longest {max(seconds):6.2f} s",
                          flush=True)  # fmt: skip
        finally:
            process.kill()
            process.wait()


def told(process: subprocess.Popen[str], began: float) -> list[tuple[str, float]]:
    """Every stage up to the last one, with the seconds since it began; hints are the findings once more."""
    found = []
    assert process.stdout is not None
    for line in process.stdout:
        if not line.startswith("{"):
            continue
        event = json.loads(line)
        stage = "hints" if event.get("last") else event["stage"]
        found.append((stage, time.perf_counter() - began))
        if stage in ("hints", "failed") or event.get("unreadable"):
            return found
    return found


if __name__ == "__main__":
    main()
