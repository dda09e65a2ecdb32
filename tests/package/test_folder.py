"""A package's folder is replaced as a whole or not at all, whatever happens in between."""

from __future__ import annotations

import os
import signal
import socket
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from sitscad.package import building, folder
from sitscad.package.building import locked_staging_folder, replace_package, write_package
from sitscad.package.folder import PackageError, write_file, write_files
from sitscad.package.manifest import MANIFEST, Entry, Manifest, sha256


def _contents(directory: Path) -> dict[str, bytes]:
    names = (name for name in folder.list_files(directory) if name != MANIFEST)
    return {name: (directory / name).read_bytes() for name in names}


def _replace(parent: Path, files: dict[str, bytes], name: str = "pack") -> Path | None:
    entries = {name: Entry(sha256(content), "kicad", "x") for name, content in files.items()}
    spec = dict.fromkeys(("name", "file", "sha256"), "x")
    with locked_staging_folder(parent, name) as staged:
        write_package(staged, files, Manifest(spec=spec, files=entries))
        return replace_package(staged, parent / name)


@pytest.mark.parametrize("exchanges", [True, False], ids=["exchange", "two renames"])
def test_new_package_replaces_old_one_completely(tmp_path, monkeypatch, exchanges):
    if not exchanges:
        monkeypatch.setattr(building, "_exchange", lambda one, other: False)
    _replace(tmp_path, {"a/one.txt": b"1", "two.txt": b"2"})
    _replace(tmp_path, {"a/three.txt": b"3"})
    assert _contents(tmp_path / "pack") == {"a/three.txt": b"3"}
    assert os.listdir(tmp_path) == ["pack"], "nothing else is left beside it"


def test_exception_during_build_leaves_old_package(tmp_path):
    _replace(tmp_path, {"one.txt": b"1"})
    with pytest.raises(KeyboardInterrupt), locked_staging_folder(tmp_path, "pack") as staged:
        write_files(staged, {"half.txt": b"half"})
        raise KeyboardInterrupt
    assert _contents(tmp_path / "pack") == {"one.txt": b"1"}
    assert os.listdir(tmp_path) == ["pack"]


def _build_and_die(parent: Path, files: dict[str, bytes], instant: int, exchanges: bool) -> int:
    """Build in a child process that kills itself before its n-th step on the disk; the child's exit status."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1]
    steps = [0]

    def counted(real):
        def call(*args, **kwargs):
            if steps[0] == instant:
                os.kill(os.getpid(), signal.SIGKILL)
            steps[0] += 1
            return real(*args, **kwargs)

        return call

    for name in ("rename", "open", "mkdir", "fsync", "unlink", "rmdir"):
        setattr(os, name, counted(getattr(os, name)))
    if not exchanges:
        building._exchange = lambda one, other: False
    _replace(parent, files)
    os._exit(0)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("exchanges", [True, False], ids=["exchange", "two renames"])
def test_build_killed_at_any_step_leaves_complete_package(tmp_path, exchanges):
    old, new = {"a/one.txt": b"old"}, {"a/one.txt": b"new 1", "two.txt": b"new 2"}
    seen = set()
    for instant in range(60):
        parent = tmp_path / str(instant)
        _replace(parent, old)
        status = _build_and_die(parent, new, instant, exchanges)
        with locked_staging_folder(parent, "pack"):
            pass  # the next build cleans up
        after = _contents(parent / "pack")
        assert after in (old, new), f"killed at step {instant}"
        assert os.listdir(parent) == ["pack"], f"leftovers after step {instant}"
        seen.add("new" if after == new else "old")
        if status == 0:
            break
        assert os.WTERMSIG(status) == signal.SIGKILL
    else:
        pytest.fail("the build never finished")
    assert seen == {"old", "new"}


def _open(parent: Path, name: str) -> bool:
    """Whether the folder could be opened; it is closed again."""
    with locked_staging_folder(parent, name) as staged:
        return staged.is_dir()


def test_second_build_of_equal_name_gives_package_error(tmp_path):
    with locked_staging_folder(tmp_path, "pack"):
        with pytest.raises(PackageError, match="another build of pack"):
            _open(tmp_path, "pack")
        assert _open(tmp_path, "other")
    assert _open(tmp_path, "pack")


ESCAPES = ["../x", "/etc/x", "a/../../x", "a//b", "a\\b", ".hidden", "a/.b", "", "a/", "C:x", "a\nb", "a b ", " a"]


@pytest.mark.parametrize("name", ESCAPES)
def test_file_name_outside_package_gives_package_error(tmp_path, name):
    with pytest.raises(PackageError):
        write_files(tmp_path, {name: b""})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["", "..", "a/b", "A", "-x", "x" * 65, "x\n"])
def test_package_name_outside_output_folder_gives_package_error(name):
    with pytest.raises(PackageError):
        folder.require_package_name(name)


def test_changed_files_are_backed_up_in_numbered_folders(tmp_path):
    files = {"kicad/board.txt": b"1", "two.txt": b"2"}
    _replace(tmp_path, files)
    (tmp_path / "pack" / "kicad" / "board.txt").write_bytes(b"mine")
    first = _replace(tmp_path, files)
    (tmp_path / "pack" / "two.txt").write_bytes(b"mine, too")
    second = _replace(tmp_path, files)
    assert (first.name, second.name) == ("pack.kept-1", "pack.kept-2")
    assert _contents(first) == {"kicad/board.txt": b"mine"} and _contents(second) == {"two.txt": b"mine, too"}
    assert _replace(tmp_path, files) is None
    assert _contents(tmp_path / "pack") == files


def _left_by_a_user(package: Path, what: str) -> Path:
    """Leave something of a kind in a package that no build wrote, and name it."""
    name = package / {
        "backups": "kicad/mine-backups/a.txt", "a lock": "notes.lck", "settings": "fpc/board.kicad_prl",
        "a cache": "fp-info-cache", "hidden": ".git/HEAD", "capitals": "KICAD/Board.txt",
    }.get(what, f"kicad/{what.replace(' ', '-')}")
    name.parent.mkdir(parents=True, exist_ok=True)
    if what == "a pipe":
        os.mkfifo(name)
    elif what == "a socket":
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(os.path.relpath(name))
    elif what.startswith("a link"):
        name.symlink_to({"a link to nowhere": "nothing", "a link to itself": name.name, "a link up": ".."}[what])
    else:
        name.write_bytes(b"mine")
    return name


KINDS = ("backups", "a lock", "settings", "a cache", "hidden", "capitals", "a pipe", "a socket", "a link to nowhere",
         "a link to itself", "a link up", "unreadable", "a folder that is closed", "a folder that is unreadable")


@pytest.mark.parametrize(
    ("what", "exchanges"), [*((kind, True) for kind in KINDS), ("a pipe", False), ("a folder that is closed", False)])
def test_user_file_of_any_kind_is_backed_up_on_replacement(
    open_folder, as_a_user, monkeypatch, what, exchanges
):
    open_folder.chmod(0o777)
    monkeypatch.chdir(open_folder)  # a socket's path may have a hundred letters
    if not exchanges:
        monkeypatch.setattr(building, "_exchange", lambda one, other: False)
    package = open_folder / "pack"
    with as_a_user():
        _replace(open_folder, {"kicad/board.txt": b"old"})
        mine = _left_by_a_user(package, what)
        closed = {"unreadable": (mine, 0), "a folder that is closed": (mine.parent, 0o555),
                  "a folder that is unreadable": (mine.parent, 0)}.get(what)
        if closed:
            closed[0].chmod(closed[1])
        stored = _replace(open_folder, {"kicad/board.txt": b"new"})
        assert _contents(package) == {"kicad/board.txt": b"new"}
        if closed:
            (stored / closed[0].relative_to(package)).chmod(0o755)
        assert os.path.lexists(stored / mine.relative_to(package))
        assert sorted(os.listdir(open_folder)) == ["pack", "pack.kept-1"], "nothing else is left beside it"
        assert not (stored / MANIFEST).exists(), "what is kept is no package"


def test_file_that_appears_during_replacement_is_backed_up(tmp_path, monkeypatch):
    _replace(tmp_path, {"one.txt": b"1"})
    real = building.read_intact_files

    def read_intact_files(old, entries):
        (old / "late.txt").write_bytes(b"mine")
        return real(old, entries)

    monkeypatch.setattr(building, "read_intact_files", read_intact_files)
    stored = _replace(tmp_path, {"one.txt": b"2"})
    assert _contents(stored) == {"late.txt": b"mine"}


@pytest.mark.slow
def test_build_killed_during_removal_loses_no_user_file(tmp_path):
    for instant in range(60):
        parent = tmp_path / str(instant)
        _replace(parent, {"a/one.txt": b"old"})
        (parent / "pack" / "a" / "mine.txt").write_bytes(b"mine")
        status = _build_and_die(parent, {"a/one.txt": b"new"}, instant, exchanges=True)
        _replace(parent, {"a/one.txt": b"newer"})
        places = [place for place in parent.iterdir() if (place / "a" / "mine.txt").is_file()]
        assert [place.name for place in places] == ["pack.kept-1"], f"killed at step {instant}"
        if status == 0:
            return
    pytest.fail("the build never finished")


BY_KICAD = ("kicad/coil.kicad_prl", "kicad/fp-info-cache", "kicad/~coil.kicad_pcb.lck",
            "kicad/coil-backups/coil-2026-11-28_121314.zip")


def test_kicad_user_files_stay_beside_project(tmp_path):
    files = {"kicad/coil.kicad_pro": b"1", "kicad/coil.kicad_pcb": b"2"}
    _replace(tmp_path, files)
    for name in BY_KICAD:
        (tmp_path / "pack" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "pack" / name).write_bytes(b"left")
    assert _replace(tmp_path, files) is None
    assert _contents(tmp_path / "pack") == files | dict.fromkeys(BY_KICAD, b"left")
    stored = _replace(tmp_path, {"one.txt": b"1"})
    assert _contents(stored) == dict.fromkeys(BY_KICAD, b"left"), "without the project they are kept aside"


def test_concurrent_writes_leave_one_complete_file(tmp_path):
    target = tmp_path / "out.txt"
    contents = [bytes([letter]) * 1000 for letter in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda content: write_file(target, content), contents * 5))
    assert target.read_bytes() in contents
    assert os.listdir(tmp_path) == ["out.txt"]


def test_unwritable_folder_gives_package_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(PackageError, match="cannot build in"):
        _open(tmp_path / "file", "pack")


def test_package_permissions_follow_umask(tmp_path):
    before = os.umask(0o022)
    try:
        _replace(tmp_path, {"one.txt": b"1"})
    finally:
        os.umask(before)
    assert (tmp_path / "pack").stat().st_mode & 0o777 == 0o755
    assert (tmp_path / "pack" / "one.txt").stat().st_mode & 0o777 == 0o644
