"""The version of sitscad, which what it makes carries."""

__version__ = "0.1.0"
