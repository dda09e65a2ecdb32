"""How a value is refused: the rule, what was read, and what may have been meant."""

from __future__ import annotations

import difflib
from typing import Any, NoReturn

from pydantic_core import PydanticCustomError


def refuse(rule: str, message: str, hint: str = "", **facts: Any) -> NoReturn:
    """Refuse a value under a rule; `facts` are the finding's measured, limit and unit, and ``meant``, the value that
    may have been meant, as it is written, with ``is_sure``, whether it cannot have been anything else.
    """
    raise PydanticCustomError(rule, "{message}", {"message": message, "hint": hint, **facts})


def described(value: Any) -> str:
    """What was read, short enough for a message."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a section"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) >= 10**30:
        return "a number of more than thirty digits"
    text = repr(value)
    return text if len(text) <= 44 else text[:41] + "..."


def did_you_mean(word: Any, allowed: tuple[str, ...]) -> str:
    """The hint for a word that is not allowed: the members of the family that it names (``ecoflex``, of
    several hardnesses), else the nearest that is; and the list.
    """
    family = _family(word, allowed)
    if family:
        return f"{word} is a family, which one is meant? {', '.join(family)}; allowed: {', '.join(allowed)}"
    near = nearest(word, allowed)
    meant = f"did you mean {near}? " if near else ""
    return f"{meant}allowed: {', '.join(allowed)}"


def nearest(word: Any, allowed: tuple[str, ...]) -> str:
    """The word out of several that one may have meant; empty where none is near, or it names a family of them."""
    close = [] if _family(word, allowed) else difflib.get_close_matches(str(word)[:64].lower(), allowed, 1, 0.5)
    return close[0] if close else ""


def _family(word: Any, allowed: tuple[str, ...]) -> list[str]:
    found = [name for name in allowed if name.startswith(f"{str(word)[:64].lower().rstrip('- ')}-")]
    return found if len(found) > 1 else []


SURELY_LIKE = 0.8
"""Share of the characters of two words that agree, from which on one is a slip for the other."""


def is_like(word: Any, meant: str) -> bool:
    """Whether a word cannot have been meant for anything but another one."""
    one, other = (text.replace("_", "-") for text in (str(word)[:64].lower(), meant))
    return difflib.SequenceMatcher(None, one, other).ratio() >= SURELY_LIKE
