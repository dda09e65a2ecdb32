"""The fingerprint of an order's images: what is hashed, in which order, and the shell line that gives the same.

A set of images is the board's (``fpc/``) or the panel's (``fpc/panel/``): its Gerber and drill files, the drill map
among them, one after another in the order of their names in the package. In the archive the same bytes have the
fabricator's names, and the readme there names them so: the shell line is a list of names, so that it gives the same in
both places.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from sitscad.fabrication.files import FOLDER, panel_path
from sitscad.layout.board import Layout

SHOWN = 16
"""So many digits of a fingerprint are printed on drawings."""


def board_images(files: Mapping[str, bytes]) -> list[str]:
    """The single board's images in the order in which they are hashed."""
    return _images(files, f"{FOLDER}/")


def panel_images(layout: Layout, files: Mapping[str, bytes]) -> list[str]:
    """The panel's images in the order in which they are hashed; none where there is no panel."""
    return _images(files, panel_path(layout, "").rpartition("/")[0] + "/")


def fingerprint(files: Mapping[str, bytes], images: list[str]) -> str:
    """The SHA-256 of some images one after another, hexadecimal."""
    digest = hashlib.sha256()
    for path in images:
        digest.update(files[path])
    return digest.hexdigest()


def shell_line(images: list[str]) -> str:
    """What prints the same where the images are."""
    return f"cat {' '.join(path.rpartition('/')[2] for path in images)} | sha256sum"


def on_drawing(whose: str, files: Mapping[str, bytes], images: list[str]) -> str:
    """The first digits, as a title block states them."""
    return f"{whose} SHA-256 {fingerprint(files, images)[:SHOWN]} ... (how: see the readme)"


def _images(files: Mapping[str, bytes], folder: str) -> list[str]:
    inside = [path for path in files if path.rpartition("/")[0] + "/" == folder]
    return sorted(path for path in inside if path.endswith((".gbr", ".drl")))
