"""``python -m sitscad`` works like ``sitscad``."""

from sitscad.cli import main

main()
