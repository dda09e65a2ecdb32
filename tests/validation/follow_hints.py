"""Hints followed to the letter: is a design better, or at least no worse, with what its findings say was tried?

    python tests/validation/follow_hints.py [-n 30] [--first 1] [--hints decisive]

checks random designs of sensible proportions (those of tests/benchmarks/check_times.py), writes every fix of every
finding into the spec, checks again, and counts what is then better (the finding is gone), equal or worse: a new error,
or a complaint that the fix does not name.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from ruamel.yaml import YAML

sys.path[:0] = [str(Path(__file__).parents[1] / "benchmarks")]

from check_times import design  # noqa: E402

from sitscad.basics.finding import Severity  # noqa: E402
from sitscad.checks.judging import check  # noqa: E402
from sitscad.spec.load import load_text  # noqa: E402
from sitscad.spec.reading import SpecError  # noqa: E402

plain = YAML(typ="safe")


def written(document, key, value):
    """A document with one dotted key changed to a value as it is written."""
    changed = json.loads(json.dumps(document))
    *parents, last = key.split(".")
    place = changed
    for parent in parents:
        place = place.setdefault(parent, {})
    place[last] = plain.load(value)
    return changed


def alternatives(finding):
    """What is said to mend a finding: lists of keys and values to be written together."""
    return [[(edit.key, edit.new.strip('"')) for edit in remedy.edits] for remedy in finding.fixes]


def complaints(findings):
    return [f for f in findings if f.severity is not Severity.NOTE]


def errors(findings):
    return [f.rule for f in findings if f.severity is Severity.ERROR]


def is_new(rule, found, after):
    """Whether more complaints of a rule stand after a change than before."""
    return [f.rule for f in complaints(after)].count(rule) > [f.rule for f in complaints(found)].count(rule)


def followed(document, only=None, hints="full"):
    """Every alternative of every hint (of `only` one rule) followed: rule, what was written, and what is then wrong."""
    findings = check(load_text(json.dumps(document), "spec.yaml"), hints=hints).findings
    for finding in (f for f in complaints(findings) if only in (None, f.rule)):
        for changes, remedy in zip(alternatives(finding), finding.fixes, strict=True):
            changed = document
            for key, value in changes:
                changed = written(changed, key, value)
            try:
                after = check(load_text(json.dumps(changed), "spec.yaml"), hints="none").findings
            except SpecError as error:
                yield finding.rule, changes, [f.message for f in error.findings]
                continue
            wrong = [rule for rule in errors(after) if errors(after).count(rule) > errors(findings).count(rule)]
            wrong += [f.rule for f in complaints(after) if (f.rule, f.key) == (finding.rule, finding.key)]
            wrong += [f.rule for f in complaints(after) if is_new(f.rule, findings, after)
                      and f.rule not in remedy.new_warnings]
            yield finding.rule, changes, wrong


def main() -> None:
    """Follow the hints of random designs and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, default=30, help="how many designs with something to follow")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--hints", default="decisive", help="what is searched: decisive or full")
    chosen = parser.parse_args()
    count: Counter[str] = Counter()
    seed, designs = chosen.first, 0
    while designs < chosen.n:
        document = json.loads(json.dumps(design(seed)))
        try:
            result = list(followed(document, hints=chosen.hints))
        except SpecError:
            result = []
        designs += bool(result)
        for rule, changes, wrong in result:
            written_as = "; ".join(f"{key}: {value}" for key, value in changes)
            count["worse" if wrong else "better"] += 1
            print(f"{seed:>4} {rule} {written_as}: {'WORSE ' + str(wrong) if wrong else 'better'}", flush=True)
        seed += 1
    print(f"{designs} designs of {seed - chosen.first}: {count['better']} changes better, {count['worse']} worse")


if __name__ == "__main__":
    main()
