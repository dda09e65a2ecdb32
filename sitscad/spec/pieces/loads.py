"""Load cases: ways in which a sensor is pushed in use. SI units."""

from __future__ import annotations

from sitscad.record import record


@record
class Mechanism:
    """A scissor grasper's levers: pull on the shaft (N), angles (rad) of the jaw's face from the axis and of lever A
    from the face, lengths (m) of lever A, of link B and from the pivot to where the jaw presses.
    """

    shaft_tension: float
    theta: float
    theta0: float
    lever: float
    link: float
    reach: float


@record
class LoadCase:
    """A way in which the target is pushed: forces (N) towards the board and along x and y, at `offset` (m) from the
    middle of the outermost face.

    With `opening` (rad) a face, inclined by so much about y and nearest to the board at +x, lies flush on the target.
    It keeps it where it is along x and y (`is_stuck`), or slides and pushes along its own normal, `normal` being the
    part towards the board. `is_held`: a face keeps the target's turn. `mechanism` says where the normal force comes
    from, which is then None here.
    """

    name: str
    normal: float | None
    shear: tuple[float, float] = (0.0, 0.0)
    offset: tuple[float, float] = (0.0, 0.0)
    opening: float = 0.0
    is_held: bool = True
    is_stuck: bool = False
    mechanism: Mechanism | None = None
