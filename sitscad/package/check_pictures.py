"""Pictures for the result of a check: the board drawn in characters, and the fit of the parts as SVG."""

from __future__ import annotations

from sitscad.assembly.places.bodies import PartsError
from sitscad.basics.finding import Severity
from sitscad.checks.findings import CheckedSpec, numbered_places
from sitscad.files.documents.drawings import fit, jaw, plan_view
from sitscad.files.drawing.pictures.layout_picture import PicturePoint, dot_picture
from sitscad.files.drawing.svg import svg
from sitscad.layout.board import Layout


def board_picture(layout: Layout, checked: CheckedSpec) -> str:
    """Return the board drawn in characters, with the numbers of findings at their places."""
    numbered = ((number, finding.place) for number, finding in numbered_places(checked.findings))
    marks = [PicturePoint(place.x, place.y, str(number), "") for number, place in numbered if place is not None]
    return dot_picture(layout, marks)


def fit_drawing(layout: Layout, checked: CheckedSpec) -> str:
    """Return a drawing of the fit of the parts as SVG, without CAD.

    If parts do not fit, it shows the closed jaws in section with each excess over a limit in red, and views of other
    faults. If they fit, it shows the jaws with dimensions. Without a jaw, it shows the parts on the board from above.
    Empty if there is nothing to draw, or if the dimensions of shield and standoff contradict each other.
    """
    grave = [finding for finding in checked.findings if finding.severity.is_at_least(Severity.WARNING)]
    forced = not checked.is_orderable
    try:
        sheet = fit.fit_sheet(layout, grave, forced) or jaw.jaw_sheet(layout, forced)
    except PartsError:
        return ""
    sheet = sheet or plan_view.plan_sheet(layout, forced)
    return "" if sheet is None else svg(sheet)
