"""Watching a spec's files: after each save, a worker process evaluates the spec, and the changes are reported."""

from __future__ import annotations

import multiprocessing
import os
import textwrap
import time
from collections.abc import Callable, Iterator, Mapping
from multiprocessing.connection import Connection, wait
from typing import Any

from sitscad.apps.watch.work import Event, serve_requests
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.basics.units import count_text

PAUSE, SETTLE = 0.1, 0.02
"""Time (s) between two checks of the files, and time (s) without a change after which a save counts as complete."""

OVERTAKEN = "overtaken"
"""Stage name of the event for a save whose evaluation was stopped because of the next save (``by``)."""

Stamp = tuple[int, int, int] | None
EventReport = Callable[[int, Event, Event | None], None]


def file_stamp(path: str) -> Stamp:
    """Return modification time, size and inode of a file. None if there is no file.

    Notifications of file systems are not used. They miss editors that rename files, and do not work in containers.
    """
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


@record(eq=False)
class Worker:
    """A worker process, with the connections for requests to it and for events from it."""

    process: multiprocessing.process.BaseProcess
    requests: Connection
    events: Connection

    def end(self) -> None:
        """Stop the process at once, and close its connections."""
        self.process.kill()
        self.process.join()
        self.requests.close()
        self.events.close()


def start_worker(path: str, serves: bool) -> Worker:
    """Start a worker process for a spec.

    It loads the modules that each evaluation needs, then waits for the first save. `serves` is True if the results are
    shown on a web page.
    """
    context = multiprocessing.get_context("spawn")
    (theirs, receiver), (sender, mine) = context.Pipe(duplex=False), context.Pipe(duplex=False)
    process = context.Process(target=serve_requests, args=(theirs, mine, path, serves), daemon=True)
    process.start()
    theirs.close()
    mine.close()
    return Worker(process, receiver, sender)


class Watch:
    """A spec that is evaluated after each save of the spec or of a file that it reads.

    A new save stops the evaluation in progress. A second worker is always ready for the new evaluation.
    """

    def __init__(self, path: str, serves: bool = False) -> None:
        self.path, self.serves = path, serves
        self.revision, self.busy, self.overtaken = 0, False, False
        self.last: dict[str, Event] = {}
        self.worker, self.spare = start_worker(path, serves), start_worker(path, serves)
        self.stamps: dict[str, Stamp] = {path: None}

    def run(self, report: EventReport, until: Callable[[], bool] = lambda: False) -> None:
        """Watch the files until interrupted, or until `until` returns True.

        `report` is called with the number of the save, each event, and the last event of the same stage.
        """
        try:
            while not until():
                self.start_evaluation_after_save()
                if self.overtaken:
                    self.overtaken = False
                    report(self.revision - 1, Event(OVERTAKEN, {"by": self.revision}), None)
                for revision, event in self.received_events():
                    report(revision, event, self.last.get(event.stage))
                    if event.stage != "failed" and not event.data.get("unreadable"):
                        self.last[event.stage] = event
        finally:
            self.worker.end()
            self.spare.end()

    def start_evaluation_after_save(self) -> None:
        """Start an evaluation if a file has changed and its save is complete."""
        stamps = {path: file_stamp(path) for path in self.stamps}
        if stamps == self.stamps or stamps[self.path] is None:
            return
        time.sleep(SETTLE)
        if {path: file_stamp(path) for path in self.stamps} != stamps:
            return
        self.stamps = stamps
        self.overtaken = self.busy
        if self.busy or not self.worker.process.is_alive():
            self.worker.end()
            self.worker, self.spare = self.spare, start_worker(self.path, self.serves)
        self.revision += 1
        self.busy = True
        self.worker.requests.send(self.revision)

    def received_events(self) -> Iterator[tuple[int, Event]]:
        """Yield the events (number of the save, event) that the worker sends within `PAUSE`."""
        for _ in wait([self.worker.events], PAUSE):
            try:
                revision, event = self.worker.events.recv()
            except EOFError:  # the worker ended: too little memory, or killed
                self.worker.end()
                self.worker, self.spare, self.busy = self.spare, start_worker(self.path, self.serves), False
                yield self.revision, Event("failed", {"message": "the process that worked it out ended without a word"})
                return
            if event is None:
                self.busy = False
                continue
            if "read" in event.data:
                self.stamps = {path: self.stamps.get(path, file_stamp(path)) for path in event.data["read"]}
            yield revision, event


SIGNS = {"new": "+", "gone": "-", "moved": "~"}


def event_changes(event: Event, before: Event | None) -> dict[str, Any]:
    """Return the differences between an event and the last event of the same stage.

    They are findings that are new, gone, or moved to another line, and numbers with their old values.
    """
    old = before.data if before is not None else {}
    if "findings" in event.data:
        now, was = (
            {(each["rule"], each["key"], each["message"]): each for each in data.get("findings", ())}
            for data in (event.data, old)
        )
        return {
            "new": [each for key, each in now.items() if key not in was],
            "gone": [each for key, each in was.items() if key not in now],
            "moved": [each | {"from": was[key]["line"]} for key, each in now.items()
                      if key in was and was[key]["line"] != each["line"]],
        }
    numbers, was = event.data.get("numbers", {}), old.get("numbers", {})
    return {"numbers": {name: [was.get(name), value] for name, value in numbers.items() if was.get(name) != value}}


def event_lines(revision: int, event: Event, before: Event | None, width: int = 80, verbose: bool = False) -> list[str]:
    """Return the terminal lines for an event.

    `before` is the last event of the same stage. For each save (number `revision`), the lines are its number, about a
    dozen lines of changes, and the verdict. Lines are at most `width` characters long. With `verbose`, all changes are
    listed, without wrapping.
    """
    changed = event_changes(event, before)
    if event.stage == "failed":
        return [event.data["message"]]
    if event.stage == OVERTAKEN:
        return [f"save {revision}: overtaken by save {event.data['by']}"]
    if event.stage == "sweep" and not verbose:
        return _study_lines(event.data["numbers"], width)
    if event.stage != "findings":
        return _all_numbers(changed["numbers"]) if verbose else _changed_number_lines(changed["numbers"])
    head = [] if event.data.get("last") else [f"save {revision}"]
    ends = event.data.get("last") or event.data.get("unreadable")
    if event.data.get("unreadable"):
        changed["gone"] = []  # unknown
    lines = [f"{SIGNS[kind]} {_finding_line(each)}" for kind in SIGNS for each in changed[kind]]
    return [*head, *(lines if verbose else _finding_rows(changed, width)),
            *([verdict_text(event.data)] if ends else [])]


ROWS = 5
"""Number of terminal rows for the findings of a save.

A row for further findings and a row for moved findings are added.
"""


def _finding_rows(changes: Mapping[str, Any], width: int) -> list[str]:
    """Return the terminal rows for findings: new findings, the most severe first, then findings that are gone.

    Signs are + (new), - (gone) and ~ (same rule and key as before, with another text). Errors may take two rows. The
    last row has the number of findings that moved to another line.
    """
    was, now = ({(each["rule"], each["key"]) for each in changes[kind]} for kind in ("gone", "new"))
    signed = [("~" if (each["rule"], each["key"]) in was else "+", each) for each in changes["new"]]
    signed.sort(key=lambda each: list(Severity).index(each[1]["severity"]))
    signed += [("-", each) for each in changes["gone"] if (each["rule"], each["key"]) not in now]
    rows: list[str] = []
    for k, (sign, each) in enumerate(signed):
        most = 2 if sign != "-" and each["severity"] == Severity.ERROR else 1
        fold = textwrap.TextWrapper(max(width, 40), subsequent_indent="    ", max_lines=most, placeholder=" ...")
        folded = fold.wrap(f"{sign} {_finding_line(each)}")
        if len(rows) + len(folded) > ROWS:
            rows.append(f"{len(signed) - k} findings more: -v, or sitscad check")
            break
        rows += folded
    moved = len(changes["moved"])
    return rows + ([f"~ {count_text(moved, 'finding')} on another line"] if moved else [])


def _study_lines(numbers: Mapping[str, str], width: int) -> list[str]:
    """Return the terminal lines on the first designs of a study.

    While designs are evaluated, the first two numbers are on one line. At the end, each number has its own line.
    """
    lines = [f"{name}: {value}" for name, value in numbers.items()]
    done, _, of = numbers["designs"].partition(" of ")
    if done != of:
        return [", ".join(lines[:2])]
    return [textwrap.shorten(line, width, placeholder=" ...") for line in lines]


def _changed_number_lines(changes: Mapping[str, list[Any]]) -> list[str]:
    """Return one line per quantity: the number with the largest relative change, and how many others changed."""
    groups: dict[str, list[str]] = {}
    for name in changes:
        groups.setdefault("to spare" if name.endswith(", to spare") else name.partition(" of ")[0], []).append(name)
    lines = []
    for names in groups.values():
        largest = max(names, key=lambda name: _relative_change(*changes[name]))
        (line,) = _all_numbers({largest: changes[largest]})
        lines.append(line + (f" ({len(names) - 1} more)" if len(names) > 1 else ""))
    return lines


def _all_numbers(changes: Mapping[str, list[Any]]) -> list[str]:
    return [f"{name}: {value if old is None else f'{old} -> {value}'}" for name, (old, value) in changes.items()]


def _relative_change(old: str | None, new: str) -> float:
    """Return the relative change between two texts of a number with a unit.

    0 if it cannot be computed, for example with different units.
    """
    (was, unit), (now, other) = (each.partition(" ")[::2] for each in (old or "", new))
    try:
        return abs(float(now) / float(was) - 1.0) if unit == other else 0.0
    except (ValueError, ZeroDivisionError):
        return 0.0


def verdict_text(data: Mapping[str, Any]) -> str:
    """Return the verdict on a design: its state, and the number of errors, warnings and notes."""
    counts = [count_text(count, kind) for kind, count in data["counts"].items() if count]
    state = "unreadable" if data.get("unreadable") else "refused" if data["counts"]["error"] else "ok"
    return f"{state}: {', '.join(counts) or 'nothing found'}"


def _finding_line(finding: Mapping[str, Any]) -> str:
    place = "" if finding["line"] is None else f"line {finding['line']}: "
    came = f" (was line {finding['from']})" if "from" in finding else ""
    return f"{place}{finding['severity']} {finding['rule']}: {finding['message']}{came}"
