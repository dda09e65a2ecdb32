"""Whether the addresses that the documentation names lead somewhere: ``python tests/validation/outer_links.py [SITE]``.

Without SITE (a folder made by `sphinx-build docs SITE`) it reads the pages, the readme and the templates. It asks
every address once, over the network, and ends with exit code 1 where one leads nowhere; what a host refuses to programs
(401, 403, 429) is told and passes. Links inside the site are held by tests/test_site.py, without a network.
"""

from __future__ import annotations

import argparse
import re
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
ADDRESS = re.compile(r"https?://[^\s\"'<>()\[\]{}`|\\,]+")
LINK = re.compile(r"(?:href|src)=\"(https?://[^\"]+)\"")
OURS = ("docs", "README.md", "CHANGELOG.md", "templates", "action.yml")
TEXTS = {".md", ".yaml", ".yml", ".csv", ".html"}
NO_PLACE = re.compile(r"https?://((www\.)?example\.(org|com)|localhost)\b")
"""Stand for the reader's own."""

REFUSED = (401, 403, 429)


def addresses_in(text: str) -> set[str]:
    """The addresses of a text, without the full stop of a sentence and without a place on the page."""
    result = (match[0].rstrip(".;:*_").partition("#")[0] for match in ADDRESS.finditer(text))
    return {address for address in result if not NO_PLACE.match(address)}


def named(folders: list[Path]) -> dict[str, list[str]]:
    """Every address in the texts of some folders, with the files that name it."""
    result: dict[str, list[str]] = {}
    for path in _texts(folders):
        text = path.read_text(encoding="utf-8", errors="replace")
        if path.suffix == ".html":  # where it leads, not the names of what it is written in
            text = " ".join(LINK.findall(text))
        for address in addresses_in(text):
            result.setdefault(address, []).append(str(path))
    return dict(sorted(result.items()))


def _texts(folders: list[Path]) -> Iterator[Path]:
    for folder in folders:
        each = sorted(folder.rglob("*")) if folder.is_dir() else [folder]
        yield from (path for path in each if path.is_file() and path.suffix in TEXTS)


def outcome(address: str, seconds: float = 20.0) -> tuple[bool, str]:
    """Whether an address leads somewhere, and what its host says."""
    request = urllib.request.Request(address, headers={"User-Agent": "Mozilla/5.0 (link check)"})
    try:
        with urllib.request.urlopen(request, timeout=seconds) as answer:
            return True, str(answer.status)
    except urllib.error.HTTPError as error:
        return error.code in REFUSED, f"{error.code} {error.reason}"
    except (OSError, ValueError) as error:
        return False, str(error)


def main() -> int:
    """Ask every address; 1 where one leads nowhere."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("site", nargs="?", type=Path, help="the folder of a built site")
    parser.add_argument("--list", action="store_true", help="print the addresses, and ask none")
    request = parser.parse_args()
    wrong = 0
    for address, files in named([request.site] if request.site else [ROOT / name for name in OURS]).items():
        leads, words = (True, "") if request.list else outcome(address)
        wrong += not leads
        print(f"{'ok' if leads else 'NOWHERE'} {address} {words} ({files[0]}{', ...' if files[1:] else ''})")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
