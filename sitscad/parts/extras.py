"""The packages behind ``sitscad[all]``, imported only when a part or a mesh is really wanted."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

_MEND = "pip install 'sitscad[all]'"
_SYSTEM_LIBRARIES = "libgl1 libxrender1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"


class MissingExtra(ImportError):
    """A package of the extra is not installed, or cannot be loaded; the text says how to mend it."""


def require(package: str) -> ModuleType:
    """Import a package of the extra; raises `MissingExtra` in one sentence when it is not there or cannot be loaded."""
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        if error.name in (package, package.partition(".")[0]):
            text = f"solids and meshes need {package}, which is not installed: {_MEND}"
        else:
            text = f"{package} is installed without {error.name}, which it needs: {_MEND}"
        raise MissingExtra(text, name=package) from error
    except (ImportError, OSError) as error:
        if _was_interrupted(error):
            raise KeyboardInterrupt from error
        raise MissingExtra(
            f"{package} cannot be loaded ({error}): {_MEND}; on Debian also apt-get install {_SYSTEM_LIBRARIES}",
            name=package,
        ) from error


def _was_interrupted(error: BaseException | None) -> bool:
    # Compiled packages turn a Ctrl-C that comes while they load into an ImportError.
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
