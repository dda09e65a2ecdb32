"""The page of a watched spec in a browser: it follows saves, keeps the camera, and greys out what is not true."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from browser import Browser

from sitscad.apps.watch.server import PageState, make_server
from sitscad.apps.watch.work import EarlierResults, stage_events

pytestmark = [pytest.mark.clients("chromium"), pytest.mark.cad, pytest.mark.slow, pytest.mark.more]

SPEC = (Path(__file__).parents[2] / "templates" / "bench_7mm.yaml").read_text(encoding="utf-8")


def test_live_page_follows_saves_and_keeps_camera(tmp_path):
    path, showing, before, last = tmp_path / "bench.yaml", PageState(), EarlierResults(), {}
    made = make_server(showing, "127.0.0.1", 0)
    threading.Thread(target=made.serve_forever, daemon=True).start()

    def save(text: str, revision: int) -> None:
        path.write_text(text, encoding="utf-8")
        for event in stage_events(str(path), before, serves=True):
            showing.publish_event(revision, event, last.get(event.stage))
            if not event.data.get("unreadable"):
                last[event.stage] = event

    def wait(what: str) -> None:
        browser.run(f"new Promise(done => {{ (function look() {{ {what} ? done(1) : setTimeout(look, 20); }})(); }})")

    with Browser() as browser:
        try:
            browser.open(f"http://127.0.0.1:{made.server_address[1]}/", "document.querySelector('aside')")
            save(SPEC, 1)
            wait("document.querySelector('canvas') && document.querySelector('#pushed input')")
            assert browser.run("document.title").startswith("bench-7mm")
            browser.run("document.querySelector('canvas').focus()")
            browser.press("ArrowLeft")
            browser.run("sitscad.kept.pushed.asked[0] = 0.5; window.scrollTo(0, 700)")
            turned = browser.run("sitscad.kept.solids.turn[0]")
            save("name: [", 2)
            wait("document.querySelector('main').classList.contains('stale')")
            assert browser.run("document.querySelector('canvas') !== null"), "the last good page is still there"
            save(SPEC.replace("bench-7mm", "bench-8mm"), 3)
            wait("document.title.startsWith('bench-8mm') && !document.querySelector('main').classList.contains('stale')"
                 " && !document.querySelector('.stale')")
            assert browser.run("sitscad.kept.solids.turn[0]") == turned and browser.run("scrollY") == 700
            assert float(browser.run("document.querySelector('[data-in=normal_N]').value")) > 0.4
            assert browser.run("document.documentElement.dataset.sitscadError") is None and browser.exceptions == []
        finally:
            made.shutdown()
            made.server_close()
