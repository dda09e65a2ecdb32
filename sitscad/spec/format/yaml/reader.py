"""One YAML text to plain values: read line by line where it is plain, which is nearly always, else as a whole."""

from __future__ import annotations

from sitscad.spec.format.yaml.plain import NotPlain, PlainReader
from sitscad.spec.format.yaml.text import MAX_BYTES, TextError, YamlText


def read_yaml(text: str) -> YamlText:
    """The values of one YAML document; raises `TextError` where there is no such document."""
    if len(text.encode("utf-8", "surrogatepass")) > MAX_BYTES:
        raise TextError("SIT010", f"the spec is larger than {MAX_BYTES // 1024} KiB", "is this the right file?")
    try:
        return PlainReader(text).read()
    except NotPlain:
        from sitscad.spec.format.yaml.whole import read_events  # its import alone takes longer than a plain text

        return read_events(text)
