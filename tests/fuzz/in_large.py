"""Fuzzing in large: ``python tests/fuzz/in_large.py [--loads N] [--checks N] [--kills N] [--seed S] [--seconds S]``.

Prints what was tried, how long the slowest took, and how much memory was in use at most; stops with exit code 1 at the
first traceback or warning of numpy's, with the text that made it. SECONDS are of the processor, for loads and for
checks; an interrupt (Ctrl-C) ends what is being tried, and its figures are printed. Nothing is sent anywhere; files are
written into a temporary folder alone.
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]

from hostile import mutated  # noqa: E402
from killed import killed_build  # noqa: E402

import sitscad  # noqa: E402

MEMORY = 2 * 1024**3
"""Address space (bytes) of this process: what wants more is found by a MemoryError, and not by the machine."""


def load(text: str) -> bool:
    """Read a text, and whether it is a spec; what is wrong with it is a `SpecError` with at least one finding."""
    try:
        sitscad.load_text(text, "fuzzed.yaml")
    except sitscad.SpecError as error:
        assert error.findings, "refused without a word"
        return False
    return True


def check(text: str) -> bool:
    """Read and check a text, and whether it is a spec."""
    try:
        spec = sitscad.load_text(text, "fuzzed.yaml")
    except sitscad.SpecError:
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # a library is silent, and what numpy warns of is no answer
        findings = sitscad.check(spec, hints="none").findings
    for finding in findings:
        assert finding.message and finding.severity
    return True


def told(name: str, work: Callable[[str], bool], count: int, texts: Iterator[str], until: float) -> int:
    """Do some work on many texts and print figures; the number of texts that were tried."""
    began, slowest, worst, done, specs = time.process_time(), 0.0, "", 0, 0
    try:
        while done < count and time.process_time() - began < until:
            text = next(texts)
            start = time.process_time()
            try:
                specs += work(text)
            except Exception as error:
                print(f"{name} {done}: {type(error).__name__}: {error}\n--- the text:\n{text}\n---", flush=True)
                raise
            done += 1
            if (took := time.process_time() - start) > slowest:
                slowest, worst = took, text
    except KeyboardInterrupt:
        print(f"{name}: interrupted")
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    seconds = time.process_time() - began
    print(
        f"{name}: {done} texts, {specs} of them specs, in {seconds:.0f} s of the processor "
        f"({1e3 * seconds / max(done, 1):.2f} ms a text), the slowest in {slowest:.2f} s, at most {megabytes:.0f} MB",
        flush=True,
    )
    if slowest > 20.0:
        print(f"--- the slowest text:\n{worst}\n---")
    return done


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("loads", 1_000_000), ("checks", 100_000), ("kills", 100), ("seed", 1), ("seconds", 3600)):
        parser.add_argument(f"--{name}", type=int, default=default)
    asked = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    rng = random.Random(asked.seed)
    texts = iter(lambda: mutated(rng), None)
    told("loads", load, asked.loads, texts, asked.seconds)
    told("checks", check, asked.checks, texts, asked.seconds)
    began, outcomes = time.perf_counter(), []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(asked.kills):
            outcomes.append(killed_build(Path(folder), random.Random(f"{asked.seed} {number}")))
            if time.perf_counter() - began > asked.seconds:
                break
    words = {word: outcomes.count(word) for word in sorted(set(outcomes))}
    print(f"kills: {len(outcomes)} builds killed, {words}", flush=True)


if __name__ == "__main__":
    main()
