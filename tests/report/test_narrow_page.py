"""Pages of packages on a telephone, and the box of a watched page, in a browser."""

from __future__ import annotations

import threading

import pytest
from browser import Browser

from sitscad.apps.watch.server import PageState, make_server
from sitscad.files.drawing.web_page import aligned_html_table, html_page, html_section

pytestmark = [pytest.mark.clients("chromium")]

ROWS = [
    (["force", "put on (N)", "read back (N)", "+- N, over all loads"], ["shear along x", "0.000", "0.000", "0.14"]),
    (["characteristic", "normal", "shear along x"],
     ["largest error by one cause, full load, one tare at the start", "1.54 N, drift at full load, 10 K",
      "65 mN, tilt of 1 degree"]),
]


@pytest.mark.slow
def test_tables_fit_390_pixel_width(tmp_path):
    """The last column of the force table and the second axis of the data sheet were cut off."""
    path = tmp_path / "page.html"
    tables = "".join(aligned_html_table(head, [row], [k > 0 for k in range(len(head))]) for head, row in ROWS)
    path.write_text(html_page("narrow", [html_section("Tables", tables)]), encoding="utf-8")
    with Browser() as browser:
        browser.call("Emulation.setDeviceMetricsOverride", width=390, height=800, deviceScaleFactor=1, mobile=True)
        browser.open(path.as_uri(), "document.querySelector('table')")
        cut = browser.run("[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth).length")
        assert browser.run("document.querySelectorAll('.scroll').length") == len(ROWS) and cut == 0


def test_closed_watch_box_reopens_at_next_save():
    showing = PageState()
    made = make_server(showing, "127.0.0.1", 0)
    threading.Thread(target=made.serve_forever, daemon=True).start()
    event = {"stage": "findings", "seconds": 0.1, "changes": {"new": [{"rule": "SIT101", "message": "x"}]}}
    with Browser() as browser:
        try:
            browser.open(f"http://127.0.0.1:{made.server_address[1]}/", "document.querySelector('aside')")

            def told(revision):
                browser.run(f"sitscad.live({event | {'revision': revision}})".replace("True", "true"))
                return browser.run("!document.querySelector('aside').hidden")

            assert told(1) and browser.run("parseFloat(document.querySelector('main').style.marginBottom)") > 0
            browser.run("document.querySelector('aside button').click()")
            assert browser.run("document.querySelector('aside').hidden") and not told(1)
            assert browser.run("document.querySelector('main').style.marginBottom") == "" and told(2)
        finally:
            made.shutdown()
            made.server_close()
