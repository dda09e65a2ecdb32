"""What webs add to a pad's stiffness: strips of its own rubber, as thick as it, from its sides to its neighbours'.

A web hinders the bulging of the side that it holds, and is itself pulled and sheared. That goes with its width, and of
a long one not with its length. Constants are fitted to finite elements at small strain of pads with one web
(tests/validation/web_figures.csv); several add up. Lengths in thicknesses, results in parts of the bare pad's own.
"""

from __future__ import annotations

import math

from sitscad.record import record

WEB_SIGMA = 0.2
"""One sigma, relative, of what webs add to a pad's force. At rest the law is within 15 % of the elements; pressed by a
tenth, a neo-Hookean square owes its webs the same within 2 %, and what it owes them beyond is taken to stay so."""


@record
class Webs:
    """Webs of one width (thicknesses) at the sides -x, +x, -y and +y of a pad: what `grip` says of each (no unit), or
    0.
    """

    width: float = 0.0
    left: float = 0.0
    right: float = 0.0
    front: float = 0.0
    back: float = 0.0

    @property
    def turned(self) -> Webs:
        """The webs looked at along the other axis (width in thicknesses): those at -y and +y are the first."""
        return Webs(self.width, self.front, self.back, self.left, self.right)


NO_WEBS = Webs()


@record
class Stiffer:
    """Factors on a bare pad's stiffness: of pressure, of shear along its first axis, of tilt that raises the ends of
    this, and of twist; no unit. `aside` is how far (thicknesses) its centre of pressure moves along that axis.
    """

    press: float = 1.0
    shear: float = 1.0
    tilt: float = 1.0
    twist: float = 1.0
    aside: float = 0.0


def grip(length: float) -> float:
    """How much (no unit) a web of a length (thicknesses) holds in comparison with a long one: the pad at its other end
    is bonded to a target, too, and near it holds the web. Fitted to our own finite elements
    (tests/validation/web_figures.csv).
    """
    return 1.0 + 1.1 * math.exp(-length / 0.6)


def stiffened(along: float, across: float, rim: float, webs: Webs) -> Stiffer:
    """What webs make of the stiffness (`Stiffer`, no unit) of a loaded rectangle, beyond which its pad reaches by a rim
    on all sides; lengths in thicknesses. Its form is from here and its constants are fitted to our own finite elements
    (tests/validation/web_figures.csv): `press` for the hindered bulging, `shear` for pull and shear of the webs, `tilt`
    and `twist` for their levers.
    """
    if not webs.width:
        return Stiffer()
    along, across = along + 2.0 * rim, across + 2.0 * rim
    # parts of the sides' lengths, both sides together: held by webs along the first axis, and by those across it
    ends, sides = (webs.left + webs.right) * webs.width / across, (webs.front + webs.back) * webs.width / along
    shape, oblong, fades = 0.5 * along * across / (along + across), (along / across) ** 1.6, math.exp(-rim / 0.6)
    pressed = 0.4 * fades / (1.0 + (shape / 2.5) ** 1.6) / (1.0 + oblong)
    at_ends = pressed * (1.0 - 0.27 * (webs.width / across) ** 4)
    at_sides = pressed * oblong * (1.0 - 0.27 * (webs.width / along) ** 4)
    press = 1.0 + at_ends * ends + at_sides * sides
    pulled, sheared = 1.06 * math.exp(-rim / 2.0), 0.48 * fades * -math.expm1(-1.55 * webs.width)
    raised = 0.27 * fades / (1.0 + 0.1 * shape**1.5) * (across / along) ** (0.15 if along < across else 0.56)
    leant = 0.095 * fades * shape**-0.5 * (along / across) ** 0.8 * webs.width / along
    lever = 0.265 * along * (along / across) ** 0.35
    return Stiffer(
        press,
        1.0 + pulled * ends / along + sheared * sides / across,
        1.0 + raised * ends + leant * sides,
        1.0 + 4.0 * sheared * (along * ends + across * sides) / (along**2 + across**2),
        lever * at_ends * (webs.right - webs.left) * webs.width / across / press,
    )
