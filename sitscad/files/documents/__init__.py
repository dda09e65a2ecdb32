"""Documents of a package: texts, drawings and lists for users and fabricators, one module each.

A new document needs one module here and one row of PAPERS.
"""

from __future__ import annotations

from sitscad.files.writer import Writer, is_cut, is_felt, is_mounted

PAPERS: tuple[Writer, ...] = (
    Writer(
        "placement", "files.documents.parts_list:render_placement", "gerber", ("layout", "estimates"),
        lambda spec: spec.readout.chip is not None or spec.soldered_thermistor is not None,
    ),
    Writer(
        "order notes", "files.documents.order_notes", "gerber",
        ("layout", "panel", "bench_estimates", "files", "forced"),
    ),
    Writer("board pictures", "files.documents.drawings.board_drawing:render_pictures", "gerber"),
    Writer("board drawing", "files.documents.drawings.board_drawing", "gerber", ("layout", "forced", "files")),
    Writer("stack-up drawing", "files.documents.drawings.stackup", "gerber", ("layout", "forced", "files")),
    Writer(
        "panel drawing", "files.documents.drawings.panel_drawing", "gerber",
        ("panel", "coupon_estimates", "forced", "files"),
    ),
    Writer("order archive", "files.documents.archive", "gerber", ("layout", "panel", "forced", "files")),
    Writer(
        "assembly drawing", "files.documents.drawings.plan_view:assembly_pdf", "laser", ("layout", "forced"), is_cut,
    ),
    Writer("laser notes", "files.documents.laser_notes", "laser", ("layout", "forced"), is_cut),
    Writer("fit proof", "files.documents.mounting:render_fit", "assembly", ("layout", "whole"), is_mounted),
    Writer("weights", "files.documents.mounting:render_weights", "assembly", ("layout", "whole"), is_mounted),
    Writer(
        "assembly notes", "files.documents.assembly_notes", "assembly",
        ("layout", "estimates", "bench_estimates", "forced", "package"), is_mounted,
    ),
    Writer("print report", "files.documents.mounting:render_print", "mount", ("solids", "aids", "spec"), is_mounted),
    Writer("jaw drawing", "files.documents.drawings.jaw", "assembly", ("layout", "forced"), is_mounted),
    Writer("assembly picture", "files.documents.mounting:render_picture", "assembly", ("layout", "solids"), is_mounted),
    Writer(
        "jig picture", "files.documents.mounting:render_jig_picture", "mount", ("layout", "solids", "aids"), is_mounted,
    ),
    Writer("firmware", "files.documents.firmware", "firmware", ("spec", "estimates", "forced")),
    Writer(
        "firmware's readme", "files.documents.firmware_driver:render_readme", "firmware",
        ("layout", "estimates", "bench_estimates", "forced"),
    ),
    Writer(
        "data sheet", "files.documents.datasheet", "datasheet",
        ("layout", "estimates", "response", "performance", "curves", "forced", "bench_estimates",
         "cell_table"),
        is_felt,
    ),
    Writer("bom", "files.documents.parts_list:render", "report", ("layout", "estimates", "forced")),
)
"""All documents, in build order. They follow the formats, because they name, archive and hash the formats' files."""
