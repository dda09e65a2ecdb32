"""The documentation's site: every page is in it, its links lead somewhere, two builds give the same bytes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def pages_in_the_contents():
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    return [
        name
        for block in re.findall(r"^```\{toctree\}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
        for name in block.split()
        if (DOCS / f"{name}.md").exists()
    ]


def test_site_contents_list_every_page_once():
    named = pages_in_the_contents()
    assert sorted(named) == sorted(page.stem for page in DOCS.glob("*.md") if page.stem != "index")


@pytest.mark.slow
def test_tutorial_specs_have_findings_stated_on_page():
    """The first is refused for its frequency alone, and the second is mended by what the page does."""
    import sitscad

    text = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    first, second = re.findall(r"^<!-- file fingertip.yaml -->\n```yaml\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    for spec in (first, second):
        findings = sitscad.check(sitscad.load_text(spec), hints="none").findings
        assert {finding.rule for finding in findings if finding.severity == "error"} == {"SIT202"}
    result = sitscad.check(sitscad.load_text(first)).findings
    assert "frequency-high" in result[[each.rule for each in result].index("SIT202")].cases


class Links(HTMLParser):
    """Where a page's links and pictures lead, and the places in it that links can lead to."""

    def __init__(self, text):
        super().__init__()
        self.links, self.places = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        text = dict(attrs)
        self.links += [text[key] for key in ("href", "src") if text.get(key)]
        self.places |= {text[key] for key in ("id", "name") if text.get(key)}


def built(folder, seed):
    pytest.importorskip("sphinx")
    pytest.importorskip("furo")
    pytest.importorskip("myst_parser")
    pytest.importorskip("build123d")
    command = (sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", folder / "kept", DOCS, folder / "site")
    environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [str(part) for part in command], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.cad
def test_site_builds_are_equal_with_valid_links(tmp_path):
    running = {name: built(tmp_path / name, seed) for name, seed in (("one", "1"), ("other", "2"))}
    for name, process in running.items():
        said, _ = process.communicate(timeout=1500)
        assert process.returncode == 0, f"{name}: {said}"
    item, other = (
        {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
        for folder in (tmp_path / "one" / "site", tmp_path / "other" / "site")
    )
    assert [path for path in item | other if item.get(path) != other.get(path)] == []
    assert len([path for path in item if path.suffix == ".svg"]) >= 14
    pages = {path: Links(data.decode()) for path, data in item.items() if path.suffix == ".html"}
    for page, result in pages.items():
        for link in result.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = Path(os.path.normpath(page.parent / unquote(parts.path))) if parts.path else page
            assert target in item, f"{page}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].places, f"{page}: {link}"


def test_external_addresses_are_extracted_from_text():
    """What asks them needs a network: tests/validation/outer_links.py."""
    from runpy import run_path

    result = run_path(str(ROOT / "tests" / "validation" / "outer_links.py"))["addresses_in"]
    text = "See <https://a.test/x#place>, (https://b.test/y.html). Yours: https://example.org/sitscad@v0.1.0"
    assert result(text) == {"https://a.test/x", "https://b.test/y.html"}
