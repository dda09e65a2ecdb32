"""Preparations of an assembly: tools, waits, casting, workpieces, files missing from a package, and order codes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from sitscad.assembly.places.bodies import plates_of
from sitscad.assembly.solids.tooling import LEAST_MIX, SiliconeMix, silicone_to_mix
from sitscad.basics.record import record, replace
from sitscad.basics.units import parse_quantity
from sitscad.data import cited, is_unverified, rows
from sitscad.estimates.loads.gluing import hard_adhesive
from sitscad.files.documents.gluing import duration_text
from sitscad.files.order_facts.notes import hanging
from sitscad.files.writer import Package
from sitscad.layout.board import Layout
from sitscad.layout.laser_sheet import is_laser_cut
from sitscad.spec import presets
from sitscad.spec.circuit import Connector
from sitscad.spec.materials import ElastomerMaterial, ElastomerPad, Shield, Target
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec

TOOLS = (
    ("microscope", "microscope with a scale"), ("gloves", "gloves"), ("isopropanol", "isopropanol"),
    ("caliper", "caliper"), ("dial gauge (on|there)", "dial gauge on a stand, and a flat plate"),
    ("dial gauge of at most", "light dial gauge"), ("cover glass", "cover glasses"),
    ("micrometer", "micrometer (not on silicone)"), ("feeler gauge", "feeler gauges"),
    ("film that no glue holds", "polyethylene or PTFE film"), ("waxed strips", "two straight strips, block, clamps"),
    ("clamp what", "vice or clamps"), ("kitchen scale", "kitchen scale"),
    ("flat stick", "flat stick"), ("open-cell foam", "soft foam and double-sided tape"),
    ("spring clamp", "spring clamp and a flat block"), ("stiff plate", "flat stiff plate and weight"),
    ("abrasive film", "abrasive film on glass"),
    ("mould release", "wax or mould release"), ("mix ", "balance, cups and stirrers"),
    ("vacuum|take the air out", "vacuum chamber"), ("1 kg[);]|with 1 kg", "weight of 1 kg"),
    ("blunt plastic tip", "blunt plastic tip"), ("cure it fully under uv", "UV lamp and oven"),
    ("acrylic lacquer", "clear acrylic lacquer"), ("petroleum jelly", "petroleum jelly"),
    ("naphtha", "naphtha or heptane"), ("microlitres", "dispenser for microlitres"),
    ("m8 washers", "M8 washers"), ("round bar of steel", "round steel bars with a hole"),
    ("flat-ended rod", "flat-ended rod"), (r"; rod (under|over)", "rod to bend over"),
    ("a blade|thin blade", "thin blade"),
    (r"with a file|file their nubs", "file"), ("polyimide tape", "polyimide tape"), ("brushed on", "brush"),
    ("zero the meter", "meter for inductance and resistance"), ("read by the converter", "converter with firmware/"),
    ("ring gauge", "ring gauge"), ("tap both holes", "tap for the cap's screws"),
    (r"screw (the mount|mount-)|set screws", "key for the screws"),
    ("mill the dovetail", "mill with a dovetail cutter"), ("drill two holes", "drill"),
    ("solder wires", "soldering iron"),
)
"""Regular expression for the text of the steps, and the tool that a matching text needs."""


def tool_list_text(steps: str) -> str:
    """List all tools that the text `steps` needs, in a whole sentence."""
    page = re.sub(r"\s+", " ", steps).lower()
    return f"Tools: {', '.join(tool for pattern, tool in TOOLS if re.search(pattern, page))}."


def waiting_time_text(layout: Layout) -> str:
    """List the longest waiting times: for a cast pad, for glue, for the film. Empty if there are none."""
    spec, texts = layout.spec, list[str]()
    if spec.elastomer is not None:
        times, cure = pour_count(spec), _cure_time_text(spec.elastomer.material.name)
        texts.append(f"cast pads, {times} pours of {cure}" if times > 1 else f"a cast pad {cure}")
    glues = {glue.product: glue.cure_time for glue in (spec.assembly.adhesive, hard_adhesive(layout)) if glue}
    texts += [f"{name} {duration_text(time)} to full strength" for name, time in glues.items() if time]
    if spec.encapsulation is not None:
        texts.append(f"the film {_cure_time_text(spec.encapsulation.material.name)}")
    return f"Longest waits: {'; '.join(texts)}." if texts else ""


def pour_count(spec: SensorSpec) -> int:
    """Return the number of mould fillings for one sensor's pads; 1 without a mould."""
    poured = silicone_to_mix(plates_of(spec))
    return 1 if poured is None else math.ceil(len(plates_of(spec).glued("elastomer")) / poured.pads)


def _cure_time_text(material: str) -> str:
    """Describe a silicone's cure time."""
    casting = presets.casting(material)
    if casting is None or not casting.cure_time:
        return f"as its maker's sheet says ({material})"
    return f"{duration_text(casting.cure_time)} ({material})"


PROCESS_TEXTS = {
    "resin": "printed in resin", "powder": "printed in powder", "filament": "printed in filament",
    "machined": "milled in plastic",
}
"""Text on the manufacturing process of the mount, by the value of `mount.process`."""

USES = (
    ("mount-adapter", "stays: between the mount and the part below"),
    ("mount-spacer", "stays: between shield and board"),
    ("mount", "stays: carries the board"),
    ("jig-base", "holds the board while pieces are glued on it"),
    ("jig-.*-press", "presses the {0} while its glue sets"),
    ("jig-.*", "guides the {0} and its press"),
    ("mould-skin", "casts the skin"),
    ("mould-.*", "casts the elastomer; not needed for a cut one"),
)
"""Regular expression for a piece's name, and the piece's purpose; the first row that matches applies."""

STAGE_OF = {"fpc/": "gerber", "laser/": "laser", "firmware/": "firmware", "bom.csv": "report"}
"""Build stage (a value of `--only`) that writes a folder or file.

The keys are the paths as in the text of the steps.
"""

STAGE_FILES = {"gerber": "fpc/", "laser": "laser/", "firmware": "firmware/", "report": "bom.csv"}
"""Folder or file that a build stage writes, as in the text of the steps. The keys are the stages."""


def piece_list_lines(mount: Mount | None, name: str, ordered: str, package: Package, width: int) -> Iterator[str]:
    """Yield the lines that list each piece to be printed or milled. Empty if the package has no ``print.json``.

    `ordered` is the sentence about the pieces that are ordered. Lines have at most `width` characters.
    """
    content = package.files.get("mount/print.json")
    if content is None:
        return
    is_own = mount is not None and mount.kind == "custom"
    pieces = [each for each in json.loads(content)["pieces"] if not (is_own and each["piece"] == "mount")]
    if not pieces:
        return
    process = mount.process if mount is not None else ""
    yield from hanging(
        "", f"{ordered}. These pieces are "
        f"{PROCESS_TEXTS.get(process, process)}, one of each, by yourself or a service, from mount/{name}-PIECE.stl "
        f"(or .3mf, .step); mount/print.json has their least walls and holes. Sizes in mm:", width)
    for each in pieces:
        piece, size = each["piece"], " x ".join(f"{1e3 * side:.1f}" for side in each["size_m"])
        use = next((purpose for pattern, purpose in USES if re.fullmatch(pattern, piece)), "")
        yield f"  {piece:<20} {size:<19} {use.format(piece.split('-')[1] if '-' in piece else '')}"
    if is_own:
        part = mount.step.file if mount is not None and mount.step is not None else "your own part"
        yield f"  {'mount':<20} {'':<19} is your own: {part}"
    if f"mount/{name}-jaw.stl" in package.files:
        yield f"  {'jaw':<20} {'':<19} is not made: the instrument's own, as the spec has it"


def cut_text(sheets: Mapping[str, ElastomerPad | Target | Shield | None]) -> str:
    """Describe the parts that are cut from sheets and how, as the end of a sentence on the board.

    Empty if there are none. `sheets` maps each part's name to the part; None if the spec lacks it.
    """
    parts_by_cutting: dict[str, list[str]] = {}
    for part, sheet in sheets.items():
        if sheet is not None:
            parts_by_cutting.setdefault(cutting_text(sheet), []).append(part)
    return "".join(f", {' and '.join(parts)} {way} by laser/" for way, parts in parts_by_cutting.items())


def cutting_text(sheet: ElastomerPad | Target | Shield) -> str:
    """Return how a piece is cut: `cut` by a laser, or `etched or punched` if no known laser cuts the metal."""
    return "cut" if is_laser_cut(sheet.material.name, sheet.thickness) else "etched or punched"


def _missing_stages(text: str, stages: frozenset[str]) -> list[str]:
    """Return the build stages whose files `text` names, but which the package does not have.

    `stages` are the stages that the package has.
    """
    return [stage for name, stage in STAGE_OF.items() if name in text and stage not in stages]


def is_missing_list_right(text: str, stages: frozenset[str]) -> bool:
    """Whether a text's list of missing files is right for a package that has the build stages `stages`.

    The list must have, in order, each stage whose files the steps of the text name and which the package lacks.
    """
    steps, _, lacking = text.partition(LACKING)
    return re.findall(r"--only\s+([a-z]+)", lacking) == _missing_stages(steps, stages)


LACKING = "Named above and not in this package"


def missing_file_lines(text: str, package: Package, width: int) -> list[str]:
    """Return the lines that list files named in the steps but missing from the package, with their build commands.

    `text` is the text of the steps. Lines have at most `width` characters.
    """
    stages = _missing_stages(text, package.stages) if package.stages else []  # no stages: text without a package
    if not stages:
        return []
    names = ", ".join(f"{STAGE_FILES[stage]} (--only {stage})" for stage in stages)
    return hanging(
        "", f"{LACKING}, which was built in part: {names}. The command for each is sitscad "
        "build SPEC with what is in brackets; SPEC is the file in spec/.", width)


@record
class Order:
    """Maker, order code, description of the part (`words`), and source of the code."""

    maker: str
    code: str
    words: str
    source: str


def order_of(kind: str, name: str, **values: Any) -> Order | None:
    """Return maker and order code of a connector, capacitor, converter or elastomer that the spec names.

    `values` are inserted into the order code. For connectors, `contacts` also selects the row. None if the data have no
    matching row.
    """
    contacts = values.get("contacts")
    row = next(
        (row for row in _table().get((kind, name), ())
         if contacts is None or not row["least"] or int(row["least"]) <= contacts <= int(row["most"])), None,
    )
    if row is None:
        return None
    return Order(row["maker"], row["code"].format(**values), row["words"], cited(row))


def connector_order(connector: Connector, contacts: int) -> Order | None:
    """Return maker and order code of a tail's connector with a number of contacts.

    The code is empty if the maker's list has no connector with this number. None if the data have no matching row.
    """
    order = order_of("connector", connector.name, contacts=contacts)
    if order is None or not connector.positions or contacts in connector.positions:
        return order
    return replace(order, code="", words=f"not in the maker's list with {contacts} contacts: find one that is made")


def capacitor_order(package: str, capacitance: float) -> Order | None:
    """Return maker and order code of a C0G capacitor (F). None beyond the maker's series.

    `package` is a name such as ``chip-0603``.
    """
    row, *_ = _table().get(("capacitor", package), [None])
    if row is None:
        return None
    low, high = (parse_quantity(row[end], "capacitance") for end in ("least", "most"))
    if not low * (1 - 1e-9) <= capacitance <= high * (1 + 1e-9):
        return None
    return order_of("capacitor", package, value=capacitance_code(capacitance))


def capacitance_code(capacitance: float) -> str:
    """Return a capacitance (F) in the makers' code (IEC 60062), such as ``221`` for 220 pF.

    The code has two digits of picofarads and the number of zeros. Below 10 pF, ``R`` is the decimal point.
    """
    value = capacitance * 1e12
    if value < 9.95:
        return f"{value:.1f}".replace(".", "R")
    zeros = math.floor(math.log10(value * (1 + 1e-9))) - 1
    digits = round(value / 10.0**zeros)
    return f"{digits}{zeros}" if digits < 100 else f"10{zeros + 1}"


@cache
def _table() -> dict[tuple[str, str], list[dict[str, str]]]:
    orders: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in rows("order_codes"):
        orders.setdefault((row["kind"], row["name"]), []).append(row)
    return orders


RAW_RESIN = (
    "Moulds printed in resin, before anything is cast in them: platinum-cure silicones (Ecoflex, Dragon Skin) may not "
    "cure on raw photopolymer. Wash the print, cure it fully under UV and then with heat, seal it (clear acrylic "
    "lacquer, or the barrier coat that the silicone's maker names), let that dry, and try a drop first; or print the "
    "mould in filament or powder. (Lacquer and trial are in Smooth-On's bulletin on Dragon Skin; the rest is general "
    "practice, unverified.)"
)
"""Preparation of a resin mould before silicone is poured into it."""


RELEASE = ("Wipe mould release for silicone thinly into every cavity and on the lid's lower face, and let it dry.")
"""Application of mould release, which keeps silicone from sticking."""


def silicone_volume_text(poured: SiliconeMix) -> str:
    """Describe the volume of silicone to mix, and the volume of the cast pieces."""
    pieces = "the pads take" if poured.pads > 1 else "the piece takes"
    share_text = f"{pieces} {1e6 * poured.pads * poured.pad:.2g} ml"
    if poured.mixed < LEAST_MIX:
        return f"{1e6 * LEAST_MIX:g} ml ({share_text}, but less cannot be weighed out well)"
    return f"{1e6 * poured.mixed:.2g} ml ({share_text})"


def silicone_mix_text(material: ElastomerMaterial) -> str:
    """Describe a silicone with its mixing ratio and pot life, or refer to its maker's sheet."""
    casting = presets.casting(material.name)
    if casting is None:
        return f"{material.name} (mixing ratio and pot life: its maker's sheet)"
    unseen = " (unverified)" if is_unverified(casting.source) else ""
    pot = f"pour within {duration_text(casting.pot_time)}" if casting.pot_time else "pot life: its maker's sheet"
    return f"{material.name} ({casting.mix}{unseen}; {pot})"


def cure_text(material: ElastomerMaterial) -> str:
    """Describe a silicone's cure time, and how to see that it has cured, in a whole sentence."""
    casting = presets.casting(material.name)
    cure_sign = "until what is left in the cup is firm and no longer sticky"
    if casting is None or casting.cure_time is None:
        return (
            f"Let it cure as long as its maker's sheet says for your temperature (\"cure time\" or \"demould time\"), "
            f"{cure_sign}."
        )
    return (
        f"Let it cure for {duration_text(casting.cure_time)} at room temperature (faster or slower grades: see the "
        f"label), {cure_sign}."
    )
