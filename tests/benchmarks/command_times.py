"""What whole commands cost, and a design in a process that is warm: checks, builds, what a build costs once more with
nothing or one value changed, a pose, an estimate.

    python tests/benchmarks/command_times.py [--before TREE] [--only gerber,kicad,...] [--repeat 3] [--write]

Times are of the processor (user and system), over all processes of a command, the best of some runs. With `--before`
the same is measured with the sources of another tree (a worktree of an older commit) and its templates, beside. Of
`--jobs` it also gives the longest process: what a check takes on a machine that has nothing else to do. With `--write`
the table takes the place of the one in docs/commands.md. It fails on nothing.
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

from sitscad.basics.finding import Edit  # noqa: E402
from sitscad.spec.yaml.rewriting import rewritten  # noqa: E402

BUILT, BOARD = "grasper_4layer", "gerber,kicad,laser,firmware"
CHANGED = Edit("readout.scan_rate", "450 Hz")
TEN = 10
TICKS = os.sysconf("SC_CLK_TCK")

PAGE = ROOT / "docs" / "commands.md"
MARKS = "<!-- costs: written by tests/benchmarks/command_times.py -->\n", "<!-- end -->\n"
"""The page with the table, and what stands before and after it there."""

WARM = """
import sys, time
import sitscad
tree, name, level, count = *sys.argv[1:4], int(sys.argv[4])
text = open(f"{tree}/templates/{name}.yaml", encoding="utf-8").read()
best = float("inf")
for k in range(count):
    other = text.replace("trace_width:", f"trace_width: {77 + 0.1 * k:.1f} um #", 1)
    began = time.process_time()
    spec = sitscad.load_text(other, "sensor.yaml")
    sitscad.measure(spec, level=level) if level else sitscad.check(spec)
    best = min(best, time.process_time() - began) if k else best
print(best)
"""
"""One design after another in a process, each with another track; prints the least seconds of the processor."""


@dataclass(frozen=True)
class Spent:
    """Processor time (s) of all processes of a command, of the longest of them, and the time on the wall."""

    total: float
    longest: float
    wall: float


def surroundings(tree: Path) -> dict[str, str]:
    """The environment of a command with a tree's sources, compiled modules kept as a user has them: to compile all of
    them again costs a build more than a second.
    """
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**inherited, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}


def spent(tree: Path, folder: Path, *arguments: str) -> Spent:
    """What one command costs with a tree's sources; exit codes 0 and 1 are both of a command that has done its work."""
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "sitscad", *arguments],
        cwd=folder, env=surroundings(tree), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )
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


def warm(tree: Path, name: str, level: str = "") -> Spent:
    """What a design costs in a process that has had one before: all up to its checks, or a level's figures."""
    done = subprocess.run([sys.executable, "-c", WARM, tree, name, level, "6"],
                          env=surroundings(tree), capture_output=True, text=True, check=True)
    return Spent(*[float(done.stdout)] * 3)


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
    os.environ["SITSCAD_CACHE"] = ""
    build = ("build", "sensor.yaml", "--force", *(("--only", only) if only else ()))

    def run(*arguments: str, times: int = repeat) -> Spent:
        return best([spent(tree, folder, *arguments) for _ in range(times)])

    run("check", specs[0], times=1)  # every module is compiled
    found = {"`check` of `single_coil`": run("check", str(tree / "templates" / "single_coil.yaml"))}
    found[f"`check` of `{BUILT}`"] = run("check", "sensor.yaml")
    for jobs in ("1", "2"):
        found[f"`check` of {len(specs)} specs, `--jobs {jobs}`"] = run("check", *specs, "--jobs", jobs)
    for name, what in ((BUILT, "two coils"), ("three_axis_grid", "four coils")):
        second = f"load, lay out, estimate and check a second `{name}` in the same Python process ({what})"
        found[second] = warm(tree, name)
    found[f"`sitscad.measure` of a second `{BUILT}` at the level `screen`, same process"] = warm(tree, BUILT, "screen")
    for form in ("text", "json"):
        found[f"`response` at one pose, {form}"] = run("response", "sensor.yaml", "--pose", "z=-0.05", "--format", form)
    found["`estimate`"] = run("estimate", "sensor.yaml")
    board = run("build", "sensor.yaml", "--force", "--only", BOARD, "-o", "board", times=1)
    found[f"`build --only {BOARD}` of `{BUILT}`"] = board
    os.environ["SITSCAD_CACHE"] = str(folder / "cache")
    found[f"`build` of all of `{BUILT}`"] = run(*build, times=1)
    found["the same command again, spec unchanged"] = run(*build)
    spec.write_text(rewritten(text, [CHANGED]), encoding="utf-8")
    found[f"the same command, `{CHANGED.key}` changed"] = run(*build, times=1)
    return found


def table(now: dict[str, Spent], before: dict[str, Spent]) -> str:
    """The figures as Markdown, beside those before where there are some."""
    old = "before | " if before else ""
    lines = [f"| command | {old}CPU seconds, all processes | CPU seconds, longest process |",
             f"|---|{'---|' * bool(before)}---|---|"]
    for name, run in now.items():
        old = f"{before[name].total:.2g} | " if name in before else " | " if before else ""
        longest = f"{run.longest:.2g}" if run.longest < 0.95 * run.total else ""
        lines.append(f"| {name} | {old}{run.total:.2g} | {longest} |")
    return "\n".join(lines) + "\n"


def write(text: str) -> None:
    """Put the table in its place in the page."""
    head, _, rest = PAGE.read_text(encoding="utf-8").partition(MARKS[0])
    PAGE.write_text(f"{head}{MARKS[0]}{text}{MARKS[1]}{rest.partition(MARKS[1])[2]}", encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, help="another tree of sources, measured beside this one")
    parser.add_argument("--only", default="", help="stages to build; all if left out")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--write", action="store_true", help="into docs/commands.md")
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as item, tempfile.TemporaryDirectory() as other:
        before = measured(chosen.before.resolve(), Path(other), chosen.only, chosen.repeat) if chosen.before else {}
        result = table(measured(ROOT, Path(item), chosen.only, chosen.repeat), before)
    print(result)
    if chosen.write:
        write(result)


if __name__ == "__main__":
    main()
