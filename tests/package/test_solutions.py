"""What is solved is kept in the user's cache: another build solves nothing anew, and its bytes are the same."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pytest

import sitscad
from sitscad.basics.finding import Edit
from sitscad.estimates.states import plate
from sitscad.estimates.windings import losses
from sitscad.kernels import solve_cache as solutions
from sitscad.kernels.electromagnetics.metal import finite_plate, near_metal
from sitscad.kernels.mechanics import pad
from sitscad.kernels.solve_cache import Solutions, cached_solution, read_cache, store_results
from sitscad.package.cached_solutions import cached_solutions
from sitscad.package.manifest import code_hash
from sitscad.spec import templates
from sitscad.spec.yaml.rewriting import rewritten

TEXT = templates.read("bench_7mm")
OTHER = rewritten(TEXT, [Edit("readout.scan_rate", "90 Hz")])


def built(text: str, out: Path) -> dict[str, bytes]:
    """The bytes of a package with what it feels, built anew."""
    folder = sitscad.build(sitscad.load_text(text, "sensor.yaml"), out, ("calibration", "report")).directory
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """The file of what the template's builds have solved."""
    monkeypatch.setenv("SITSCAD_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "bench-7mm.solved"


@pytest.mark.slow
def test_changed_scan_rate_reuses_all_cached_solutions(cache, tmp_path, monkeypatch):
    message = set[bytes]()

    def heard(question, solve):
        message.update(part if isinstance(part, bytes) else repr(part).encode() for part in question()[:1])
        return cached_solution(question, solve)

    for module in (pad, plate, finite_plate, losses):
        monkeypatch.setattr(module, "cached_solution", heard)
    built(TEXT, tmp_path / "one")
    assert any(b"Coil(" in each for each in message)
    assert {b"BondedPad", b"LossesNearMetal"} <= {each.partition(b"(")[0] for each in message}
    for word in (b"...", b" at 0x", b"array("):  # a text that leaves out what is asked would answer something else
        assert not any(word in each for each in message), word
    assert cache.stat().st_size < solutions.MOST
    assert [path.name for path in (tmp_path / "one").iterdir()] == ["bench-7mm"]
    first = cache.read_bytes()
    monkeypatch.setattr(pad.BondedPad, "_solve_poses", None)
    monkeypatch.setattr(plate, "SolvedTarget", None)
    monkeypatch.setattr(finite_plate, "_solved_changes", None)
    monkeypatch.setattr(near_metal, "crowding_near_metal", None)
    known = built(OTHER, tmp_path / "two")
    assert cache.read_bytes() == first, "nothing new, nothing written"
    monkeypatch.undo()
    monkeypatch.setenv("SITSCAD_CACHE", "")
    assert built(OTHER, tmp_path / "three") == known


QUESTION = ("what", 0.1)


def stored(*answers: float) -> Solutions:
    """A store that was asked once."""
    store = Solutions()
    with store_results(store):
        cached_solution(lambda: QUESTION, lambda: (np.array(answers), np.array([1j])))
    return store


def asked(store: Solutions) -> tuple[list[float], list[complex]] | None:
    """What a store knows; None where it would solve."""
    with store_results(store):
        result = cached_solution(lambda: QUESTION, lambda: ())
    return (result[0].tolist(), result[1].tolist()) if result else None


def test_cache_file_preserves_every_bit_and_results_are_read_only():
    answers = (0.1, -0.0, np.inf, 5e-324)
    again = read_cache(stored(*answers).as_bytes("code"), "code")
    assert asked(again) == ([*answers], [1j]) and str(asked(again)[0][1]) == "-0.0"
    with store_results(again), pytest.raises(ValueError, match="read-only"):
        cached_solution(lambda: QUESTION, lambda: ())[0][0] = 1.0


def test_cache_of_other_code_or_damaged_file_is_ignored(monkeypatch):
    file = stored(0.1).as_bytes("code")
    assert asked(read_cache(file, "other code")) is None
    for at in range(0, len(file), 7):
        assert asked(read_cache(file[:at] + bytes([file[at] ^ 1]) + file[at + 1 :], "code")) is None, at
    assert asked(read_cache(file[:-1], "code")) is None and asked(read_cache(b"", "code")) is None
    monkeypatch.setattr(np, "__version__", "1.0")
    assert asked(read_cache(file, "code")) is None


def test_full_store_drops_unused_solutions(monkeypatch):
    monkeypatch.setattr(solutions, "MOST", 3 * (solutions.HEAD + 80))
    store = Solutions()
    with store_results(store):
        for number in range(5):
            cached_solution(lambda number=number: (number,), lambda: (np.zeros(10),))
        store.forget()
        assert len(store.known) == 3
        cached_solution(lambda: ("new",), lambda: (np.ones(10),))
        store.forget()
    assert len(store.known) == 3 and sum(answer[0][0] for answer in store.known.values()) == 1.0


@pytest.mark.parametrize("harm", ["damaged", "a folder", "a pipe", "no folder may be made", "relative"])
def test_unusable_cache_file_is_ignored(cache, harm, tmp_path, monkeypatch):
    cache.parent.mkdir()
    if harm == "damaged":
        cache.write_bytes(b"[]\n[]\n")
    elif harm == "a folder":
        cache.mkdir()
    elif harm == "a pipe":  # nobody writes into it: who opens it waits
        os.mkfifo(cache)
    else:
        (tmp_path / "file").touch()
        monkeypatch.setenv("SITSCAD_CACHE", str(tmp_path / "file") if harm.startswith("no") else "cache")
        monkeypatch.chdir(cache.parent)
    with cached_solutions("bench-7mm"):
        assert asked_for_one() == 1.0
    assert cache.is_file() == (harm in ("damaged", "a pipe"))
    assert (tmp_path / "file").is_file() == (harm[:2] in ("no", "re"))
    if harm == "damaged":
        with cached_solutions("bench-7mm"):
            assert cached_solution(lambda: ("one",), lambda: ())[0] == 1.0


def asked_for_one() -> float:
    """An answer that a store keeps, whose question is always the same."""
    return float(cached_solution(lambda: ("one",), lambda: (np.ones(1),))[0][0])


def test_concurrent_builds_and_full_cache_give_correct_results(cache, monkeypatch):
    with cached_solutions("bench-7mm"):
        asked_for_one()
        with cached_solutions("bench-7mm"):
            cached_solution(lambda: ("two",), lambda: (np.ones(1),))
    with cached_solutions("bench-7mm", writes=False):
        assert asked_for_one() == 1.0 and cached_solution(lambda: ("two",),
                                                          lambda: ()) == (), "the last one's file is whole"
    monkeypatch.setattr("sitscad.package.cached_solutions.MOST_CACHED", cache.stat().st_size + 10)
    (cache.parent / "mine.solved.txt").write_bytes(bytes(100))
    (cache.parent / "nowhere.solved").symlink_to(cache.parent / "gone")
    with cached_solutions("other"):
        asked_for_one()
    assert {path.name for path in cache.parent.iterdir()} == {"other.solved", "mine.solved.txt", "nowhere.solved"}


@pytest.mark.parametrize("parts", ['[["<f8", -1]]', '[["<f8", 10, 10]]', "[" * 5000, '[["", 1]]'])
def test_malformed_cache_file_with_valid_hash_is_ignored(cache, parts):
    cache.parent.mkdir()
    conditions = json.dumps(solutions._cache_conditions(code_hash()))
    head = f'{{"by": {conditions}, "solutions": {{"one": {parts}}}}}\n'.encode()
    cache.write_bytes(hashlib.sha256(head).hexdigest().encode() + b"\n" + head)
    with cached_solutions("bench-7mm"):
        assert asked_for_one() == 1.0
