"""The version of sitscad, written into every file that sitscad makes."""

__version__ = "0.1.0"
