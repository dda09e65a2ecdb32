"""The picture of the rooms in docs/house.md says what is so."""

from __future__ import annotations

import re

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
