"""What whole commands cost: a cold check of ten specs, a full build, the same again, and with one value changed, a pose
and an estimate; and what two processes save over ten different specs.

    python tests/benchmarks/command_times.py [--before TREE] [--only gerber,kicad,...] [--repeat 3]

Times are of the processor (user and system), over all processes of a command, the best of some runs. With `--before`
the same is measured with the sources of another tree (a worktree of an older commit) and its templates, beside. Of
`--jobs` it also gives the longest process: what the command takes on a machine that has nothing else to do. It fails
on nothing.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from sitscad.finding import Edit  # noqa: E402
from sitscad.spec.yaml.rewriting import rewritten  # noqa: E402

BUILT = "grasper_4layer"
CHANGED = Edit("readout.scan_rate", "450 Hz")
TEN = 10
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Spent:
    """Processor time (s) of all processes of a command, of the longest of them, and the time on the wall."""

    total: float
    longest: float
    wall: float


def spent(tree: Path, folder: Path, *arguments: str) -> Spent:
    """What one command costs with a tree's sources; exit codes 0 and 1 are both of a command that has done its work."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "sitscad", *arguments],
        cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    seen: dict[int, float] = {}
    while os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        seen |= dict(_running(process.pid))
        time.sleep(0.02)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode in (0, 1), f"sitscad {' '.join(arguments)}: exit code {process.returncode}"
    total = usage.ru_utime + usage.ru_stime
    workers = [seconds for pid, seconds in seen.items() if pid != process.pid]
    own = total - sum(workers)
    return Spent(total, own + max(workers, default=0.0), time.perf_counter() - began)


def _running(pid: int) -> Iterator[tuple[int, float]]:
    """A process and those that it started, each with its processor time (s) until now."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        yield pid, (int(fields[11]) + int(fields[12])) / TICKS
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            yield from _running(int(child))
    except OSError:  # it has ended since
        return


def best(runs: Sequence[Spent]) -> Spent:
    """The run that cost least."""
    return min(runs, key=lambda run: run.total)


def measured(tree: Path, folder: Path, only: str, repeat: int) -> dict[str, Spent]:
    """Every piece of work by its name, with the sources of one tree."""
    specs = [str(path) for path in sorted((tree / "templates").glob("*.yaml"))][:TEN]
    text = (tree / "templates" / f"{BUILT}.yaml").read_text(encoding="utf-8")
    spec = folder / "sensor.yaml"
    spec.write_text(text, encoding="utf-8")
    build = ("build", "sensor.yaml", "--force", *(("--only", only) if only else ()))
    spent(tree, folder, "check", specs[0])  # every module is compiled
    found = {f"check of {len(specs)} specs, cold, --jobs 1": best(
        [spent(tree, folder, "check", *specs, "--jobs", "1") for _ in range(repeat)]
    )}  # fmt: skip
    found["the same with --jobs 2"] = best([spent(tree, folder, "check", *specs, "--jobs", "2") for _ in range(repeat)])
    found["build, all of it"] = spent(tree, folder, *build)
    found["build again, nothing changed"] = best([spent(tree, folder, *build) for _ in range(repeat + 2)])
    pose = ("response", "sensor.yaml", "--pose", "z=-0.05")
    for form in ("text", "json"):
        runs = [spent(tree, folder, *pose, "--format", form) for _ in range(repeat)]
        found[f"response at one pose, {form}"] = best(runs)
    found["estimate"] = best([spent(tree, folder, "estimate", "sensor.yaml") for _ in range(repeat)])
    spec.write_text(rewritten(text, [CHANGED]), encoding="utf-8")
    found[f"build, {CHANGED.key} changed"] = spent(tree, folder, *build)
    return found


def table(now: dict[str, Spent], before: dict[str, Spent]) -> str:
    """The figures side by side as Markdown."""
    lines = ["| command | before | now | longest process, now | wall, now |", "|---|---|---|---|---|"]
    for name, run in now.items():
        old = f"{before[name].total:.2f} s" if name in before else ""
        lines.append(f"| {name} | {old} | {run.total:.2f} s | {run.longest:.2f} s | {run.wall:.2f} s |")
    one, two = list(now.values())[:2]
    share = f"--jobs 2 over --jobs 1: longest process {two.longest / one.longest:.2f}, wall {two.wall / one.wall:.2f}"
    return "\n".join([*lines, "", f"{share}, all processes {two.total / one.total:.2f}"])


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, help="another tree of sources, measured beside this one")
    parser.add_argument("--only", default="", help="stages to build; all if left out")
    parser.add_argument("--repeat", type=int, default=3)
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as other:
        before = measured(chosen.before.resolve(), Path(other), chosen.only, chosen.repeat) if chosen.before else {}
        print(table(measured(ROOT, Path(one), chosen.only, chosen.repeat), before))


if __name__ == "__main__":
    main()
