"""A scissor grasper's levers: from the pull on its shaft to the force between its jaws. SI units.

Each jaw turns about a common pivot on the shaft's axis and ends, behind the pivot, in lever A; links B join both levers
to a pin that the shaft pulls along the axis. docs/mechanism.md derives the formula and says why it is not the one that
is printed as equation 3.1 of Jones's thesis.
"""

from __future__ import annotations

import math


def link_angle(lever_angle: float, lever: float, link: float) -> float:
    """Angle (rad) of link B to the axis, of the angle (rad) of lever A to it: asin(LA sin(theta + theta0) / LB), the
    law of sines. Raises ValueError where link B does not reach the axis.
    """
    sine = lever * math.sin(lever_angle) / link
    if not abs(sine) < 1.0:
        raise ValueError("link B does not reach the axis")
    return math.asin(sine)


def tip_force(tension: float, lever_angle: float, lever: float, link: float, reach: float) -> float:
    """Force (N) that each jaw exerts, square to its face, `reach` (m) from the pivot, under a pull on the shaft (N),
    without friction: F_IN LA sin(theta + theta0 + beta) / (2 L_j cos beta), beta being `link_angle`.

    By virtual work: the pin's travel times the pull is the work of both jaws. Raises ValueError where link B does not
    reach the axis, or for a reach that is not positive.
    """
    if not reach > 0.0:
        raise ValueError("a jaw presses at a positive distance from its pivot")
    beta = link_angle(lever_angle, lever, link)
    return tension * lever * math.sin(lever_angle + beta) / (2.0 * reach * math.cos(beta))
