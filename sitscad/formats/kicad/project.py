"""A KiCad 9 project of the flexible circuit: board, rules, and libraries of footprints and of symbols."""

from __future__ import annotations

from sitscad.formats.kicad.board import board
from sitscad.formats.kicad.capacitor import capacitor_footprints
from sitscad.formats.kicad.coil import coil_footprints
from sitscad.formats.kicad.footprint import FOOTPRINT_NAME, library_footprint
from sitscad.formats.kicad.rules import custom_rules, project
from sitscad.formats.kicad.sexpr import quoted
from sitscad.formats.kicad.symbol import library_table, symbol_library
from sitscad.layout.board import Layout


def render(layout: Layout) -> dict[str, bytes]:
    """The files of ``kicad/`` by their path in the package: project, board, custom rules, footprints and symbols.

    The board lies in the middle of the sheet (millimetres, y negated as KiCad's points down); KiCad's origin for drill
    files is the layout's, so plots made from it fall on the package's own Gerber files. Raises ValueError for what
    KiCad cannot hold: a contact on an inner layer, an opening with a hole in it.
    """
    name = layout.spec.name
    files = {
        f"kicad/{name}.kicad_pro": project(layout),
        f"kicad/{name}.kicad_pcb": board(layout),
        f"kicad/{name}.kicad_dru": custom_rules(layout),
    }
    library = ({FOOTPRINT_NAME: library_footprint(layout)} if layout.pads else {}) | coil_footprints(layout)
    library |= capacitor_footprints(layout)
    files |= {f"kicad/{name}.pretty/{footprint}.kicad_mod": text for footprint, text in library.items()}
    if library:
        files["kicad/fp-lib-table"] = _library_table(name)
        files[f"kicad/{name}.kicad_sym"] = symbol_library(layout)
        files["kicad/sym-lib-table"] = library_table(name)
    return {path: text.encode("utf-8") for path, text in files.items()}


def _library_table(name: str) -> str:
    uri = quoted(f"${{KIPRJMOD}}/{name}.pretty")
    row = f'(lib (name {quoted(name)})(type "KiCad")(uri {uri})(options "")(descr "The contacts and coils of {name}"))'
    return f"(fp_lib_table\n  (version 7)\n  {row}\n)\n"
