"""Without the extra the parts can be imported and say what is missing."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import types

import pytest

from sitscad.assembly.solids import MissingExtra, solid

HEAVY = ("build123d", "cadquery", "OCP", "gmsh", "manifold3d", "trimesh", "scipy", "matplotlib", "ezdxf", "shapely")
MODULES = (
    "sitscad.assembly.solids, sitscad.assembly.solids.solid, sitscad.files.drawing.pictures.rendered, "
    "sitscad.assembly.solids.pieces, "
    "sitscad.files.formats.step, sitscad.files.formats.meshes, sitscad.files.formats.volume_mesh, "
    "sitscad.files.documents.mounting"
)


def test_import_of_parts_and_writers_loads_no_cad():
    code = f"import {MODULES}, sys; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_closed_section_loads_no_cad():
    import handmade

    from sitscad.assembly.places.fit import closed_section

    before = {name for name in HEAVY if name in sys.modules}
    assert closed_section(handmade.jaw_sensor()) is not None
    assert {name for name in HEAVY if name in sys.modules} == before


def test_missing_package_is_refused_with_install_command():
    with pytest.raises(MissingExtra) as caught:
        solid.import_extra("sitscad_has_no_such_package")
    text = str(caught.value)
    assert "pip install 'sitscad[all]'" in text
    assert "sitscad_has_no_such_package" in text
    assert "\n" not in text
    assert isinstance(caught.value, ImportError)


def test_missing_system_library_is_named(monkeypatch):
    def broken(name: str) -> types.ModuleType:
        raise OSError("libGL.so.1: cannot open shared object file")

    monkeypatch.setattr(solid, "import_module", broken)
    with pytest.raises(MissingExtra, match=r"libGL\.so\.1.*sitscad\[all\].*libgl1"):
        solid.import_extra("gmsh")


def test_missing_dependency_of_package_is_named(monkeypatch):
    def broken(name: str) -> types.ModuleType:
        raise ModuleNotFoundError("No module named 'OCP'", name="OCP")

    monkeypatch.setattr(solid, "import_module", broken)
    with pytest.raises(MissingExtra, match=r"build123d is installed without OCP.*pip install"):
        solid.import_extra("build123d")


def test_interrupted_package_import_raises_keyboard_interrupt(monkeypatch):
    """A Ctrl-C within a compiled package's start came out as "cannot be loaded: pip install ..."."""

    def interrupted(package):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise ImportError("initialization failed") from error

    monkeypatch.setattr(solid, "import_module", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solid.import_extra("build123d")


def test_unused_cad_dependencies_load_on_demand(tmp_path, monkeypatch):
    (tmp_path / "aside.py").write_text("there = 5\n")
    (tmp_path / "inside.py").write_text("import aside\n\ndef asked():\n    return aside.there\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(solid, "UNUSED", ("aside", "sitscad_has_no_such_package"))
    inside = solid.import_extra("inside")
    assert "there" not in vars(sys.modules["aside"])
    assert importlib.util.find_spec("aside").origin == str(tmp_path / "aside.py")  # others see that it is there
    assert inside.asked() == 5
    assert sys.modules["aside"].there == 5
    assert not isinstance(sys.modules["aside"], type(inside.aside))
    for name in ("aside", "inside"):
        del sys.modules[name]


@pytest.mark.slow
def test_cad_kernels_start_without_sympy_and_vtk():
    code = (
        "from sitscad.assembly.solids.solid import UNUSED, import_extra\nimport sys\n"
        "for name in ('build123d', 'cadquery', 'trimesh', 'matplotlib.figure'): import_extra(name)\n"
        "assert not [m for m in sys.modules if m.startswith('sympy.')]\n"
        "assert 'vtkmodules.vtkFiltersSources' not in sys.modules\n"
        "import vtk, build123d.objects_curve as curves, cadquery\n"
        "print(curves.sympy.Integer(7) ** 2, vtk.vtkSphereSource().GetRadius(), "
        "cadquery.Workplane().box(1, 1, 1).val().toVtkPolyData(0.1).GetNumberOfCells() > 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["49", "0.5", "True"]
