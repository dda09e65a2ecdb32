"""A shield behind the board, and how all is glued; what carries the sensor is in `mounting`."""

from __future__ import annotations

from sitscad.record import record
from sitscad.spec.materials import Adhesive, Conductor


@record
class Assembly:
    """How the pieces are put together: what they are glued with, the thickness of each glue line (m) and its
    tolerance (m), and tolerances (m) of parts by name that go before those of their process; the bore of the tube
    behind the jaws and the diameter of their hinge's pin (m), None where they are what is usual for the port.
    """

    adhesive: Adhesive | None = None
    glue_line: float = 0.0
    glue_tolerance: float = 0.0
    tolerances: tuple[tuple[str, float], ...] = ()
    shaft_bore: float | None = None
    hinge_pin: float | None = None

    def tolerance(self, part: str) -> float | None:
        """The tolerance (m) that the spec gives a part; None where it leaves it to the part's process."""
        return dict(self.tolerances).get(part)


@record
class Shield:
    """A sheet between coil and jaw: ``gap`` is from the board's bottom face to the sheet, ``kerf`` what a laser takes
    (0: drawn as it is; all m).
    """

    material: Conductor
    thickness: float
    gap: float
    kerf: float = 0.0
