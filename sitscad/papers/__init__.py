"""What people read of a package, and what goes to a fabricator beside its files: one module with a `render` each. A new
paper is one module here, and one row of PAPERS.
"""

from __future__ import annotations

from sitscad.writer import Writer, is_cut, is_felt, is_mounted

PAPERS: tuple[Writer, ...] = (
    Writer(
        "placement", "papers.parts_list:render_placement", "gerber", ("layout", "estimates"),
        lambda spec: spec.readout.chip is not None,
    ),
    Writer("order notes", "papers.order_notes", "gerber", ("layout", "panel", "bench_estimates", "files", "forced")),
    Writer("board pictures", "papers.drawings.board:render_pictures", "gerber"),
    Writer("board drawing", "papers.drawings.board", "gerber", ("layout", "forced", "files")),
    Writer("stack-up drawing", "papers.drawings.stackup", "gerber", ("layout", "forced", "files")),
    Writer("panel drawing", "papers.drawings.panel", "gerber", ("panel", "coupon_estimates", "forced", "files")),
    Writer("order archive", "papers.archive", "gerber", ("layout", "panel", "forced", "files")),
    Writer("assembly drawing", "papers.drawings.plan_view:assembly_pdf", "laser", ("layout", "forced"), is_cut),
    Writer("laser notes", "papers.laser_notes", "laser", ("layout", "forced"), is_cut),
    Writer("fit proof", "papers.mounting:render_fit", "assembly", ("layout", "whole"), is_mounted),
    Writer("weights", "papers.mounting:render_weights", "assembly", ("layout", "whole"), is_mounted),
    Writer(
        "assembly notes", "papers.assembly_notes", "assembly",
        ("layout", "estimates", "bench_estimates", "forced", "package"), is_mounted,
    ),
    Writer("print report", "papers.mounting:render_print", "mount", ("solids", "aids", "spec"), is_mounted),
    Writer("jaw drawing", "papers.drawings.jaw", "assembly", ("layout", "forced"), is_mounted),
    Writer("assembly picture", "papers.mounting:render_picture", "assembly", ("layout", "solids"), is_mounted),
    Writer("jig picture", "papers.mounting:render_jig_picture", "mount", ("layout", "solids", "aids"), is_mounted),
    Writer("firmware", "papers.firmware", "firmware", ("spec", "estimates", "forced")),
    Writer(
        "firmware's readme", "papers.firmware_driver:render_readme", "firmware",
        ("layout", "estimates", "bench_estimates", "forced"),
    ),
    Writer(
        "data sheet", "papers.datasheet", "datasheet",
        ("layout", "estimates", "response", "performance", "curves", "forced", "bench_estimates",
         "cell_table"),
        is_felt,
    ),
    Writer("bom", "papers.parts_list:render", "report", ("layout", "estimates", "forced")),
)
"""Every paper, in the order in which a package is made, after the formats: they name, archive and hash the files."""
