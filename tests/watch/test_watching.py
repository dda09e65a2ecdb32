"""A watched spec: what a save changes is told, in order and soon; what it leaves as it was is not made again."""

from __future__ import annotations

import http.client
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from urllib.request import urlopen

import pytest

from sitscad.apps.watch.server import MAX_CONNECTIONS, PageServer, PageState, make_server
from sitscad.apps.watch.watching import event_changes, event_lines, file_stamp
from sitscad.apps.watch.work import EarlierResults, Event, stage_events
from sitscad.basics.finding import Edit
from sitscad.checks.fixes.search import Search
from sitscad.cli import main
from sitscad.spec.yaml.rewriting import rewritten

TREE = Path(__file__).parents[2]
SPEC = (TREE / "templates" / "single_coil.yaml").read_text(encoding="utf-8")
BENCH = (TREE / "templates" / "bench_7mm.yaml").read_text(encoding="utf-8")


def _finding(rule: str, line: int, message: str) -> dict[str, object]:
    place = {"line": line, "column": 1, "key": "coil"}
    return {"rule": rule, "severity": "warning", **place, "message": message, "hint": ""}


def _verdict(*findings: dict[str, object]) -> Event:
    return Event("findings", {"counts": {"error": 0, "warning": len(findings), "note": 0}, "findings": list(findings)})


def test_watch_reports_only_changed_findings_and_numbers():
    first = _verdict(_finding("SIT103", 4, "narrow"), _finding("SIT215", 6, "weak"))
    then = _verdict(_finding("SIT103", 5, "narrow"), _finding("SIT217", 7, "small"))
    result = event_changes(then, first)
    assert [[each["rule"] for each in result[kind]] for kind in ("new", "gone", "moved")] == [
        ["SIT217"], ["SIT215"], ["SIT103"]]
    message = event_lines(2, Event("findings", then.data | {"last": True}), first, verbose=True)
    assert message[0].startswith("+ line 7") and message[1].startswith("- line 6") and message[-1] == "ok: 2 warnings"
    assert message[2].startswith("~ line 5") and message[2].endswith("(was line 4)")
    assert event_lines(2, then, then) == ["save 2"]
    numbers = Event("estimate", {"numbers": {"L of C1": "2 uH", "L of C2": "3 uH", "f of C1": "1 MHz"}})
    later = Event("estimate", {"numbers": {"L of C1": "2.1 uH", "L of C2": "4 uH", "f of C1": "1 MHz"}})
    assert event_lines(2, later, numbers) == ["L of C2: 3 uH -> 4 uH (1 more)"]
    assert event_lines(2, later, numbers, verbose=True) == ["L of C1: 2 uH -> 2.1 uH", "L of C2: 3 uH -> 4 uH"]


def test_overtaken_save_prints_one_line():
    """Of two saves in the work of the one before nothing was said: after save 1 came save 4."""
    assert event_lines(2, Event("overtaken", {"by": 3}), None) == ["save 2: overtaken by save 3"]


def test_save_prints_at_most_twelve_lines_with_verdict_last():
    first = _verdict(_finding("SIT204", 3, "1.4 V"), *(
        _finding(f"SIT1{k:02}", k, "gone") for k in range(3)))
    new = [_finding("SIT204", 3, "1.3 V"), *(_finding(f"SIT3{k:02}", k, "narrow " * 40) for k in range(9))]
    error = _finding("SIT112", 9, "no room " * 40) | {"severity": "error"}
    then = _verdict(*new, error)
    then = Event("findings", then.data | {"last": True, "counts": {"error": 1, "warning": 10, "note": 0}})
    said = event_lines(2, then, first)
    assert len(said) == 7 and all(len(line) <= 80 for line in said) and said[-1] == "refused: 1 error, 10 warnings"
    assert said[0].startswith("+ line 9: error SIT112") and said[1].startswith("    no room")
    assert said[2] == "~ line 3: warning SIT204: 1.3 V" and said[5] == "10 findings more: -v, or sitscad check"
    unread = event_lines(3, Event("findings", _verdict(error).data | {"unreadable": True}), first)
    assert unread[-1].startswith("unreadable") and not [line for line in unread if line.startswith("-")]


def test_study_progress_prints_one_short_line_and_final_best():
    numbers = {"designs": "9 of 64", "keep everything": "1", "maximize rp": "5 kohm with " + "coil.turns: 9, " * 9}
    event = Event("sweep", {"numbers": numbers})
    assert event_lines(1, event, None) == ["designs: 9 of 64, keep everything: 1"]
    said = event_lines(1, Event("sweep", {"numbers": numbers | {"designs": "64 of 64"}}), event)
    assert said[:2] == ["designs: 64 of 64", "keep everything: 1"] and said[2].endswith(" ...") and len(said[2]) <= 80
    assert event_lines(1, Event("sweep", {"numbers": numbers | {"designs": "10 of 64"}}), event, verbose=True) == [
        "designs: 9 of 64 -> 10 of 64"]


@pytest.mark.slow
def test_stage_events_are_ordered_and_invalid_spec_reports_findings(tmp_path):
    path = tmp_path / "bench.yaml"
    path.write_text(BENCH, encoding="utf-8")
    before = EarlierResults()
    events = list(stage_events(str(path), before, serves=False))
    assert [event.stage for event in events] == ["findings", "estimate", "feeling", "findings"]
    assert events[0].data["counts"]["error"] == 0 and events[-1].data["last"]
    assert "resolution of normal" in events[2].data["numbers"]
    path.write_text("sitscad: 1\nname: 4\n", encoding="utf-8")
    (broken,) = stage_events(str(path), before, serves=False)
    assert broken.data["unreadable"] and {each["line"] for each in broken.data["findings"]} == {1, 2}
    assert before.designs, "the last design that could be read is kept"


@pytest.mark.slow
@pytest.mark.cad
def test_changed_readout_reuses_drawing_solution_and_solids(tmp_path, monkeypatch):
    path = tmp_path / "bench.yaml"
    own = rewritten(BENCH, [Edit("elastomer.thickness", "1.93")])  # of another test's pad the process knows the shear
    path.write_text(own, encoding="utf-8")
    before = EarlierResults()
    first = list(stage_events(str(path), before, serves=True))
    assert "board" in [event.stage for event in first] and b"<svg" in first[1].page
    solids = before.files["solids"]

    def drawn(*_: object) -> None:
        raise AssertionError("drawn anew")

    monkeypatch.setattr("sitscad.checks.trials.Trials.mending", lambda *_: Search())  # which draws other boards
    monkeypatch.setattr("sitscad.estimates.design.arrange", drawn)
    monkeypatch.setattr("sitscad.kernels.mechanics.pad.BondedPad._solve_poses", drawn)
    monkeypatch.setattr("sitscad.estimates.states.plate.SolvedTarget", drawn)
    monkeypatch.setattr("sitscad.estimates.design.lay_out", drawn)
    path.write_text(rewritten(own, [Edit("readout.scan_rate", "60 Hz")]), encoding="utf-8")
    second = list(stage_events(str(path), before, serves=True))
    assert [event.stage for event in second] == [event.stage for event in first]
    assert before.files["solids"] is solids
    assert second[3].data["numbers"] != first[3].data["numbers"], "a slower scan tells smaller forces apart"


def test_file_stamp_changes_when_file_is_replaced_by_equal_size(tmp_path):
    item, other = tmp_path / "a", tmp_path / "b"
    item.write_text("x")
    other.write_text("y")
    os.utime(other, ns=(item.stat().st_atime_ns, item.stat().st_mtime_ns))
    seen = file_stamp(str(item))
    os.replace(other, item)
    assert file_stamp(str(item)) != seen and file_stamp(str(tmp_path / "none")) is None


@pytest.fixture
def served():
    showing = PageState()
    made = make_server(showing, "127.0.0.1", 0)
    threading.Thread(target=made.serve_forever, daemon=True).start()
    yield showing, made.server_address[1]
    made.shutdown()
    made.server_close()


def _get(port: int, path: str, host: str | None = None) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers={"Host": host or f"localhost:{port}"})
    answer = connection.getresponse()
    return answer.status, answer.read(), dict(answer.getheaders())


def test_server_answers_only_known_paths_and_its_own_host_name(served):
    showing, port = served
    showing.publish_event(1, _verdict(_finding("SIT103", 4, "narrow")), None)
    assert _get(port, "/")[0] == 200 and "default-src 'none'" in _get(port, "/")[2]["Content-Security-Policy"]
    assert [_get(port, path)[0] for path in ("/etc/passwd", "/../work.py", "/report.html")] == [404] * 3
    for host in ("attacker.example", f"attacker.example:{port}", "localhost", ""):
        assert _get(port, "/", host or " ")[0] == 403
    state = json.loads(_get(port, "/state")[1])
    assert state["findings"]["verdict"] == "ok: 1 warning" and state["findings"]["revision"] == 1


def test_new_listener_receives_last_event_per_stage_and_later_events(served):
    showing, port = served
    showing.publish_event(1, _verdict(), None)
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", "/events", headers={"Host": f"127.0.0.1:{port}"})
    answer = connection.getresponse()
    assert answer.getheader("Content-Type") == "text/event-stream"
    assert json.loads(answer.readline()[6:])["stage"] == "findings" and answer.readline() == b"\n"
    showing.publish_event(2, Event("failed", {"message": "no"}), None)
    assert json.loads(answer.readline()[6:])["message"] == "no"


@contextmanager
def _serving(host: str, port: int = 0) -> Iterator[PageServer]:
    made = make_server(PageState(), host, port)
    thread = threading.Thread(target=made.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield made
    finally:
        made.shutdown()
        made.server_close()


HAS_IPV6 = socket.has_ipv6 and Path("/proc/net/if_inet6").exists() and "lo" in Path("/proc/net/if_inet6").read_text()


@pytest.mark.parametrize("host", [
    "127.0.0.1", "localhost", "0.0.0.0",
    *(pytest.param(host, marks=pytest.mark.skipif(not HAS_IPV6, reason="no IPv6 here")) for host in ("::1", "[::1]")),
])
def test_page_is_served_on_each_host_address(host):
    with _serving(host) as made, urlopen(made.url, timeout=10) as answer:
        assert answer.status == 200


def test_server_on_all_addresses_answers_only_addresses_and_own_name(monkeypatch):
    monkeypatch.setattr(socket, "gethostname", lambda: "Workshop")
    with _serving("0.0.0.0") as made:
        port = made.server_port
        for host in ("192.168.1.20", "[fe80::1]", "workshop", "WORKSHOP", "localhost"):
            assert _get(port, "/", f"{host}:{port}")[0] == 200
        for host in ("attacker.example", "1.2.3.4.attacker.example", "192.168.1.999", "workshop.example"):
            assert _get(port, "/", f"{host}:{port}")[0] == 403
        assert _get(port, "/", f"192.168.1.20:{port + 1}")[0] == 403


def test_loopback_server_refuses_other_addresses(served):
    _, port = served
    assert _get(port, "/", f"192.168.1.20:{port}")[0] == 403 and _get(port, "/", f"LOCALHOST:{port}")[0] == 200


def test_host_header_without_port_is_accepted_on_port_80(served, monkeypatch):
    _, port = served
    assert _get(port, "/", "localhost")[0] == 403
    monkeypatch.setattr("sitscad.apps.watch.server.HTTP_PORT", port)
    assert _get(port, "/", "localhost")[0] == 200 and _get(port, "/", "attacker.example")[0] == 403


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: localhost:PORT\r\n\r\n",
                                  b"GET /events HTTP/1.1\r\nHost: localhost:PORT\r\n\r\n", b"\0\xff" * 100])
def test_closed_browser_prints_no_traceback(served, sent, capfd):
    showing, port = served
    showing.page = b"x" * 4_000_000
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", port), timeout=10) as line:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # leave by a reset
            line.sendall(sent.replace(b"PORT", str(port).encode()))
            time.sleep(0.05)
    for _ in range(3):
        showing.publish_data({"stage": "x"})
        time.sleep(0.05)
    assert _get(port, "/state")[0] == 200
    assert capfd.readouterr() == ("", "")


def _unfinished_requests(port: int, count: int) -> list[socket.socket]:
    """Connections that begin a request and do not end it."""
    lines = [socket.create_connection(("127.0.0.1", port), timeout=10) for _ in range(count)]
    for line in lines:
        with suppress(OSError):  # it is refused already
            line.sendall(b"GET / HT")
    return lines


def test_connections_beyond_limit_get_503_without_new_thread():
    with _serving("127.0.0.1") as made, ExitStack() as end:
        threads = threading.active_count()
        lines = list(map(end.enter_context, _unfinished_requests(made.server_port, MAX_CONNECTIONS + 20)))
        assert all(b"503" in _answer(line) for line in lines[MAX_CONNECTIONS:])
        assert threading.active_count() <= threads + MAX_CONNECTIONS


def test_unfinished_request_is_closed_after_timeout(monkeypatch):
    monkeypatch.setattr("sitscad.apps.watch.server.REQUEST_TIMEOUT", 0.2)
    with _serving("127.0.0.1") as made, ExitStack() as end:
        lines = list(map(end.enter_context, _unfinished_requests(made.server_port, 5)))
        assert [_answer(line) for line in lines] == [b""] * 5
        assert _get(made.server_port, "/")[0] == 200


def _answer(line: socket.socket) -> bytes:
    """All that comes until the connection ends."""
    try:
        return b"".join(iter(lambda: line.recv(1000), b""))
    except ConnectionError:
        return b"503"  # it was ended before the answer could be read


def test_taken_port_or_invalid_host_is_reported(tmp_path, capsys, served):
    path = tmp_path / "coil.yaml"
    path.write_text(SPEC, encoding="utf-8")
    for arguments in (["--port", str(served[1])], ["--host", "no host"], ["--host", "x" * 300]):
        with pytest.raises(SystemExit) as stop:
            main(["watch", str(path), "--serve", *arguments])
        assert stop.value.code == 2 and "cannot be served" in capsys.readouterr().err


class Watched:
    """`sitscad watch` as a process, its lines as they come."""

    def __init__(self, path: Path, *arguments: str) -> None:
        command = [sys.executable, "-m", "sitscad", "watch", str(path), "--format", "json", *arguments]
        around = {**os.environ, "PYTHONPATH": str(TREE), "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=TREE, env=around)

    def until(self, wanted) -> dict:
        """The first event that is wanted."""
        assert self.process.stdout is not None
        while True:
            line = self.process.stdout.readline()
            assert line, "it has ended"
            if line.startswith("{") and wanted(event := json.loads(line)):
                return event


@pytest.fixture
def watched(tmp_path):
    path = tmp_path / "coil.yaml"
    path.write_text(SPEC, encoding="utf-8")
    result = Watched(path)
    yield result, path
    result.process.kill()
    result.process.wait()


def _saved(path: Path, text: str) -> None:
    beside = path.with_suffix(".new")  # as editors do: another file takes its place
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


@pytest.mark.slow
def test_watch_follows_saves_and_exits_0_on_interrupt(watched):
    result, path = watched
    assert result.until(lambda event: event["stage"] == "estimate")["revision"] == 1
    _saved(path, SPEC.replace("sitscad: 1", "sitscad: one"))
    assert result.until(lambda event: event["revision"] == 2)["unreadable"]
    path.unlink()
    time.sleep(0.3)
    _saved(path, SPEC)
    result.until(lambda event: event["revision"] == 3)
    _saved(path, SPEC + "# again\n")
    third = result.until(lambda event: event["revision"] == 3 and (event["stage"] == "overtaken" or event.get("last")))
    assert third.get("last") or third == {"stage": "overtaken", "revision": 3, "by": 4}  # or it was done before
    last = result.until(lambda event: event["revision"] == 4 and event.get("last"))
    assert last["counts"]["error"] == 0
    result.process.send_signal(signal.SIGINT)
    assert result.process.wait(20) == 0


@pytest.mark.slow
@pytest.mark.more
def test_hundred_saves_with_invalid_specs_end_with_correct_verdict(watched):
    """No crash, the last one is what is said at the end, and memory stays where it was."""
    result, path = watched
    result.until(lambda event: event.get("last"))

    def memory() -> int:
        family = [result.process.pid, *_children(result.process.pid)]
        return sum(int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 for pid in family)

    sizes = []
    for number in range(100):
        text = SPEC.replace("name:", "nam:") if number % 7 == 3 else SPEC + f"# {number}\n"
        _saved(path, text)
        if number % 5 == 0:
            result.until(lambda event: event["stage"] == "findings")
            sizes.append(memory())
        else:
            time.sleep(0.05)
    _saved(path, SPEC.replace("turns: ", "turns: 0.5 # "))
    end = result.until(lambda event: event.get("last") or event.get("unreadable"))
    while any("turns" in each["key"] for each in end["findings"]) is False:
        end = result.until(lambda event: event.get("last") or event.get("unreadable"))
    assert max(sizes[10:]) < 1.5 * max(sizes[:5])


def _children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def test_watched_study_completes_and_save_reuses_matching_designs(tmp_path):
    (tmp_path / "coil.yaml").write_text(SPEC, encoding="utf-8")
    path = tmp_path / "study.yaml"
    text = "sitscad_study: 1\nbase: coil.yaml\nvary: {coil.turns: [11, 12, 13]}\ngoals: [maximize: rp]\naccept: all\n"
    path.write_text(text, encoding="utf-8")
    before = EarlierResults()
    first, *sweep = stage_events(str(path), before, serves=True)
    assert first.stage == "findings" and first.data["read"] == [str(path), str(tmp_path / "coil.yaml")]
    assert {event.stage for event in sweep} == {"sweep"} and len(before.evaluated) == 3
    numbers = sweep[-1].data["numbers"]
    assert numbers["designs"] == "3 of 3" and "with coil.turns: " in numbers["maximize rp"]
    assert b"The front so far" in sweep[-1].page and b"3 of 3 designs" in sweep[-1].page
    path.write_text(text.replace("maximize", "minimize"), encoding="utf-8")
    known = dict(before.evaluated)
    last = list(stage_events(str(path), before, serves=False))[-1]
    assert "minimize rp" in last.data["numbers"] and before.evaluated == known
    path.write_text(text.replace("turns", "turs"), encoding="utf-8")
    (broken,) = stage_events(str(path), before, serves=False)
    assert broken.data["unreadable"] and broken.data["findings"][0]["line"] == 3
