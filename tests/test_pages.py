"""What README and the pages of docs show is what the program does: outputs of commands, files, pictures, tables."""

from __future__ import annotations

from difflib import unified_diff

import pages
import pytest

BUILT = {"assembling", "examples", "getting-started", "templates", "tutorial"}
"""Pages that show packages: CAD, some ten seconds each, that of all templates a hundred."""


def differences(name: str) -> list[str]:
    """Lines by which a page and its pictures differ from what the program shows now, the first twenty of each file."""
    result: list[str] = []
    for path, data in pages.made(name).items():
        before = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
        now = data.decode(errors="replace").splitlines()
        result += list(unified_diff(before.splitlines(), now, path.name, "shown now", n=0))[:20]
    return result


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=(pytest.mark.clients("gcc"), pytest.mark.slow)) if name == "bring_up" else name
     for name in sorted(pages.PAGES.keys() - BUILT)],
)
def test_generated_page_equals_program_output(name):
    assert differences(name) == [], f"run python docs/pages.py {name}"


@pytest.mark.slow
@pytest.mark.cad
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.more) if name in ("assembling", "examples", "templates") else name
             for name in sorted(BUILT)],
)
def test_generated_package_page_equals_program_output(name):
    assert differences(name) == [], f"run python docs/pages.py {name}"


@pytest.fixture
def page(tmp_path, monkeypatch):
    path = tmp_path / "page.md"
    monkeypatch.setitem(pages.PAGES, "page", path)
    return path


FRESH = """# A page

<!-- file c.yaml -->
```yaml
sitscad: 1
```

<!-- exit 2, last 1 -->
```console
$ sitscad check c.yaml
```

<!-- shows c.yaml -->
```text
```

<!-- picture docs/pictures/grasper-4layer-body.svg -->
![a board](made/board.svg)
"""


@pytest.mark.slow
def test_generated_page_is_current_after_one_run(page):
    page.write_text(FRESH, encoding="utf-8")
    assert pages.stale("page") == ["page.md", "board.svg"]
    made = pages.made("page")
    text = made[page].decode()
    assert "\n$ sitscad check c.yaml\n...\nnot ok: " in text and "```text\nsitscad: 1\n```" in text
    assert text.startswith(FRESH.partition("$")[0])
    for path, data in made.items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
    assert pages.stale("page") == []
    page.write_text(text.replace("not ok", "ok"), encoding="utf-8")
    assert pages.stale("page") == ["page.md"]


def test_page_with_wrong_exit_code_is_refused(page):
    page.write_text(FRESH.replace("exit 2", "exit 1"), encoding="utf-8")
    with pytest.raises(ValueError, match="ended with 2, not 1"):
        pages.made("page")
