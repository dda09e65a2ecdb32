"""What the tests need from outside, and what happens where it is missing: a skip that says why, or an error in CI."""

from __future__ import annotations

import ctypes
import functools
import gc
import importlib
import importlib.util
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest

# Two threads of linear algebra in each of two test processes wait for each other more than they work
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Text comes as in a pipe, however wide the terminal is that the tests run in
os.environ.pop("COLUMNS", None)

# No test finds solved what another has solved, perhaps with a function of its own
os.environ["SITSCAD_CACHE"] = ""

# Commands run in this process do not keep it from freeing what they leave, as they do in one of their own
gc.freeze = lambda: None
gc.set_threshold(100_000, 20, 20)  # Python's own numbers look at young objects a hundred times as often
gc.set_threshold = lambda *_: None

# Examples of a property whose test names no number; those that CI chooses are always the same
if importlib.util.find_spec("hypothesis"):
    from hypothesis import settings

    settings.register_profile("quick", settings.default, max_examples=40)
    settings.load_profile("quick")

# Programs that a test interrupts listen to Ctrl-C even where these tests themselves run in the background, which do not
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parents[1]
TEMPLATES = ROOT / "templates"
REFERENCES = ROOT / "tests/validation"

CAD_MODULES = ("build123d", "cadquery", "OCP", "gmsh", "manifold3d", "trimesh")

FINITE_ELEMENTS = ("ngsolve",)
"""Modules of the dependency group `references`, which computed figures that tests compare with."""
INSTALL_EXTRA = "pip install 'sitscad[all,test]' brings it"
INSTALL_CLIENTS = ".ci/install-clients installs it on Debian 12"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "needs(*modules): needs importable modules that the light core does not bring")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Give each test process half of the tests in one piece: pieces of modules build the modules' fixtures again."""
    if getattr(config.option, "numprocesses", None) and config.option.dist == "no":
        config.option.dist = "worksteal"


def pytest_testnodedown(node: object, error: object) -> None:
    """Tell how a test process of pytest-xdist ended that did not end by itself: its exit code, or minus its signal."""
    if error:
        try:
            how: object = node.gateway._io.popen.wait(timeout=10)
        except Exception as refused:  # told, whatever it is: the run goes on with a successor
            how = refused
        print(f"\n{node.gateway.id} ended with {how}")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test whose means are missing; with SITSCAD_SKIP_NOTHING set, as in CI, fail it instead."""
    modules = [name for mark in item.iter_markers("needs") for name in mark.args]
    if item.get_closest_marker("cad"):
        modules += CAD_MODULES
    programs = [name for mark in item.iter_markers("clients") for name in mark.args]
    reasons = [f"{name} is not installed: {INSTALL_EXTRA}" for name in modules if not _importable(name)]
    reasons += [f"{name} is not installed: {INSTALL_CLIENTS}" for name in programs if not shutil.which(name)]
    if reasons and os.environ.get("SITSCAD_SKIP_NOTHING"):
        pytest.fail("; ".join(reasons), pytrace=False)
    if reasons:
        pytest.skip("; ".join(reasons))


if os.environ.get("SITSCAD_SKIP_NOTHING"):  # what a test asks for in its own words fails alike
    skipped_import = pytest.importorskip

    def imported(name: str, *args: object, **words: object) -> object:
        """The module; an error where it is missing, but for the finite elements, which no installation needs."""
        return skipped_import(name, *args, **words) if name in FINITE_ELEMENTS else importlib.import_module(name)

    pytest.importorskip = imported


def _importable(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the cases of a test beyond its `few` as slow and `more`, and the slow references of tests/validation."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("few"):
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
        if REFERENCES in item.path.parents and item.get_closest_marker("slow"):
            item.add_marker("more")
    for each in cases.values():
        counted = [item for item in each if item.get_closest_marker("slow")] or each
        for item in counted[each[0].get_closest_marker("few").args[0] :]:
            item.add_marker("slow")
            item.add_marker("more")


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown() -> None:
    """Empty the caches of solutions and look for rings of designs where memory grows.

    A large target with its potentials keeps 0.2 GB. Python does not count arrays as a reason to look for rings.
    """
    if resident() > swept_at[0] + 200e6:
        for cache in [item for item in gc.get_objects() if isinstance(item, functools._lru_cache_wrapper)]:
            if cache.__module__.startswith("sitscad.") and cache.cache_parameters()["maxsize"] is not None:
                cache.cache_clear()
        gc.collect()
        if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):  # of glibc: freed memory goes back to the system
            trim(0)
        swept_at[0] = resident()


swept_at = [0.0]
"""Memory (bytes) of this process after it last looked for rings."""


def resident() -> float:
    """Memory (bytes) of this process; 0 where the system does not tell it."""
    try:
        with open("/proc/self/statm", encoding="ascii") as stream:
            return 4096.0 * int(stream.read().split()[1])
    except OSError:
        return 0.0


@contextmanager
def as_nobody() -> Iterator[None]:
    """Root gives up its right to write anything, for a while; others have none to give up."""
    if os.geteuid() == 0:
        os.setresuid(65534, 65534, 0)
    try:
        yield
    finally:
        if os.getresuid()[2] == 0:
            os.setresuid(0, 0, 0)


@pytest.fixture
def as_a_user() -> Callable[[], AbstractContextManager[None]]:
    """What makes the code under it run without root's rights."""
    return as_nobody


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that others may enter and read; pytest's own are closed to them."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.fixture(scope="session")
def root() -> Path:
    """The top of the source tree."""
    return ROOT


@pytest.fixture(params=[2, 4], ids=["2 layers", "4 layers"])
def board(request: pytest.FixtureRequest):
    """The hand-made board of two coils, with two and with four copper layers."""
    import layouts

    return layouts.two_coils(request.param)


EVERY_KEY = ("bench_of_cells", "drawn_coil", "fingertip", "jaw_from_a_file", "jaw_of_sheet", "own_mount")
"""Samples that together have every key of the format at a value that is no default."""


@pytest.fixture(scope="module")
def every_key_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """These samples with the outline and the drawn coil that they name, and STEP files that hold no part."""
    import ezdxf
    from drawn_boards import two_layers

    place = tmp_path_factory.mktemp("keys") / "specs"
    shutil.copytree(ROOT / "tests/samples/every_key", place)
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = 4
    drawing.modelspace().add_lwpolyline([(-16, -17), (16, -17), (16, 17), (-16, 17)], close=True)
    drawing.saveas(place / "body.dxf")
    (place / "coil.kicad_pcb").write_text(two_layers())
    (place / "parts").mkdir()
    for name in ("parts/jaw.step", "own.step"):
        (place / name).write_bytes(b"ISO-10303-21;\nEND-ISO-10303-21;\n")
    return place


SHOWN = ("grasper_3p5mm", "racetrack_jaw", "square_bench", "three_axis_pad")
"""Templates on which tests of all templates run every time: two and four layers, round, square and long coils, a pair,
a grid."""


def as_shown(stem: str) -> object:
    """A template's name as a parameter, marked if tests of it are left out in CI."""
    return pytest.param(stem, marks=() if stem in SHOWN else (pytest.mark.slow, pytest.mark.more))


@pytest.fixture(scope="session", params=[as_shown(path.stem) for path in sorted(TEMPLATES.glob("*.yaml"))])
def template(request: pytest.FixtureRequest) -> Path:
    """Every template in turn."""
    return TEMPLATES / f"{request.param}.yaml"
