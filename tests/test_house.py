"""The picture of the rooms in docs/house.md says what is so."""

from __future__ import annotations

import re
import subprocess

import pytest

from tests.test_import_map import MAY_IMPORT, PACKAGE

TEXT = (PACKAGE.parent / "docs" / "house.md").read_text(encoding="utf-8")
ROWS = [re.split(r"\s*\|\s*", line.strip("| \n")) for line in TEXT.splitlines() if re.match(r"\| `\w+` \|", line)]


def test_every_room_has_a_row():
    rooms = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").is_file()} - {"data", "templates"}
    assert {row[0].strip("`") for row in ROWS} == rooms & set(MAY_IMPORT) and len(ROWS) > 15


def test_no_room_is_said_to_import_what_it_may_not():
    for room, _, _, imports in ROWS:
        named = set(re.findall(r"\w+", imports)) - {"nothing"}
        assert named <= MAY_IMPORT[room.strip("`")], room


def test_what_is_pointed_at_exists():
    paths = set(re.findall(r"`([a-z_]+/[\w/]+\.(?:py|csv))`", TEXT))
    assert len(paths) > 8
    assert not [path for path in paths if not (PACKAGE / path).is_file() and not path.startswith("tests/")]
    for room, _, modules, _ in ROWS:
        for module in re.findall(r"`([\w/]+)`", modules):
            here = PACKAGE / room.strip("`") / module
            assert here.is_dir() or here.with_suffix(".py").is_file(), (room, module)


AT_THE_TOP = {
    ".ci", ".github", ".gitignore", ".pre-commit-hooks.yaml", "CHANGELOG.md", "LICENSE", "README.md", "action.yml",
    "constraints.txt", "docs", "outputs", "pyproject.toml", "sitscad", "templates", "tests",
}


@pytest.mark.clients("git")
def test_a_trial_leaves_nothing_at_the_top():
    """Specs and tables that a trial wrote there were committed with it."""
    if not (PACKAGE.parent / ".git").exists():
        pytest.skip("no repository: what is kept in it cannot be told")
    asked = ["git", "-c", "safe.directory=*", "ls-tree", "--name-only", "HEAD"]
    found = subprocess.run(asked, cwd=PACKAGE.parent, capture_output=True, text=True, check=True)
    assert set(found.stdout.split()) == AT_THE_TOP
