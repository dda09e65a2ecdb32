"""How long after a save each stage of `sitscad watch` is told: median and longest over some saves of one kind each.

    python tests/benchmarks/watch_latency.py [TEMPLATE] [--saves 20] [--loaded 1]

A save waits for the last stage of the one before, so nothing is interrupted; every seventh is broken. `--loaded` are
processes that burn beside it. Seconds of the processor are what a machine takes that has nothing else to do. It says,
too, how large the process that works is after each kind. It fails on nothing.
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

from sitscad.basics.finding import Edit  # noqa: E402
from sitscad.spec.yaml.rewriting import rewritten  # noqa: E402

KINDS = {
    "another scan rate": ("readout.scan_rate", "{:.1f} Hz", 400.0, 1.0),
    "another pad": ("elastomer.thickness", "{:.3f}", 0.62, 0.001),
    "another track": ("coil.trace_width", "{:.1f} um", 78.0, 0.1),
}
"""Saves: key, how its value is written, the first and the step."""

PAUSE = 0.5
"""Seconds between the last stage of a save and the next save."""


def main() -> None:
    """Print one row a kind and stage."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("template", nargs="?", default="grasper_4layer")
    parser.add_argument("--saves", type=int, default=20)
    parser.add_argument("--loaded", type=int, default=0)
    asked = parser.parse_args()
    burning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(asked.loaded)]
    text = (ROOT / "templates" / f"{asked.template}.yaml").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "watched.yaml"
        path.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "sitscad", "watch", str(path), "--serve", "--format", "json"]
        around = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "SITSCAD_CACHE": ""}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=around, cwd=ROOT)
        try:
            told(process)
            for kind, (key, written, first, step) in KINDS.items():
                spent: dict[str, list[tuple[float, float]]] = {}
                for number in range(asked.saves):
                    time.sleep(PAUSE)
                    changed = rewritten(text, [Edit(key, written.format(first + step * number))])
                    if number % 7 == 6:
                        changed = changed.replace("name:", "nam:")
                    path.with_suffix(".new").write_text(changed, encoding="utf-8")
                    os.replace(path.with_suffix(".new"), path)
                    for stage, *seconds in told(process):
                        spent.setdefault(stage if "name:" in changed else "refused", []).append((*seconds,))
                for stage, every in spent.items():
                    wall, own = (sorted(each) for each in zip(*every, strict=True))
                    print(f"{kind:20} {stage:10} {statistics.median(wall):6.2f} s, longest {wall[-1]:6.2f} s; of the "
                          f"processor {statistics.median(own):6.2f} s, longest {own[-1]:6.2f} s", flush=True)
                print(f"{kind:20} {max(memory(child) for child in children(process)) / 1e6:.0f} MB", flush=True)
        finally:
            for each in (process, *burning):
                each.kill()
                each.wait()


def children(process: subprocess.Popen[str]) -> list[int]:
    """The processes that a process has started."""
    return [int(pid) for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]


def processor(process: subprocess.Popen[str]) -> float:
    """Seconds of the processor that those have spent."""
    fields = [Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in children(process)]
    return sum(float(each[11]) + float(each[12]) for each in fields) / os.sysconf("SC_CLK_TCK")


def memory(pid: int) -> float:
    """Bytes that a process has in memory."""
    return float(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def told(process: subprocess.Popen[str]) -> list[tuple[str, float, float]]:
    """Every stage up to the last one, with the seconds since the save, on the wall and of the processor; hints are the
    findings once more.
    """
    result, began, spent = [], time.perf_counter(), processor(process)
    assert process.stdout is not None
    for line in process.stdout:
        if not line.startswith("{"):
            continue
        event = json.loads(line)
        stage = "hints" if event.get("last") else event["stage"]
        result.append((stage, time.perf_counter() - began, processor(process) - spent))
        if stage in ("hints", "failed") or event.get("unreadable"):
            return result
    return result


if __name__ == "__main__":
    main()
