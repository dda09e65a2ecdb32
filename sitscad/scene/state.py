"""The states that a sensor is looked at in: the coil alone, assembled, pressed."""

from __future__ import annotations

from sitscad.record import record
from sitscad.scene.pose import Pose

FREE, REST, PRESSED = "free", "rest", "pressed"

_WORDS = {FREE: "alone in free air", REST: "at rest", PRESSED: "pressed"}
_TITLES = {FREE: "free (coil alone)", REST: "at rest (assembled)", PRESSED: "pressed (required force)"}

NAMED = tuple(_TITLES)
"""The states that every sensor of these parts has, in the order in which they are shown."""


@record
class State:
    """One state by its name: where the target is, the force (N) that presses it there, and the temperature (degrees
    Celsius) of all metal.

    Without a pose there is nothing round the coil: neither target nor jaw nor neighbours.
    """

    name: str
    pose: Pose | None = None
    force: float = 0.0
    temperature: float = 20.0

    @property
    def is_free(self) -> bool:
        """Whether the coil is alone."""
        return self.pose is None


def in_words(state: str) -> str:
    """A state as a sentence names it: at rest."""
    return _WORDS.get(state, state)


def titled(state: str) -> str:
    """A state as the head of a row names it: at rest (assembled)."""
    return _TITLES.get(state, state.replace("_", " "))
