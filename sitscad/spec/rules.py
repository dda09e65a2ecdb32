"""What can be wrong with the spec itself: the table behind `sitscad rules` and `sitscad explain` for SIT0xx."""

from __future__ import annotations

from collections.abc import Mapping

from sitscad.finding import Finding, Severity
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.source import SpecSource


@record
class SpecRule:
    """One rule of the spec: what it asks for, why, and how to mend a breach."""

    id: str
    name: str
    summary: str
    why: str
    mend: str
    severity: Severity = Severity.ERROR


class SpecError(ValueError):
    """The spec cannot be used; `findings` says everything that is wrong with it, in the order of the file.

    ``texts`` are the texts of other files that findings point into, by path. ``cramped`` is the spec as it was read
    where nothing is wrong with it but that turns or coils lack room (`ROOM_RULES`): it cannot be made, but mended.
    ``source`` is the text that was read, None where none could be.
    """

    def __init__(
        self,
        findings: tuple[Finding, ...],
        texts: Mapping[str, str] | None = None,
        cramped: SensorSpec | None = None,
        source: SpecSource | None = None,
    ) -> None:
        super().__init__("; ".join(finding.message for finding in findings))
        self.findings = findings
        self.texts = dict(texts or {})
        self.cramped = cramped
        self.source = source


ROOM_RULES = ("SIT014", "SIT016")
"""The rules of the spec that say that coils or their turns have no room."""


SPEC_RULES: tuple[SpecRule, ...] = (
    SpecRule(
        "SIT001",
        "not-yaml",
        "The file is one YAML 1.2 document, a mapping of keys to values.",
        "A file that does not parse has no meaning, and guessing one could put a wrong coil on order.",
        "Mend the syntax at the place shown: indent with spaces, put a space after each colon, "
        "close every bracket and quote.",
    ),
    SpecRule(
        "SIT002",
        "unknown-key",
        "Every key is one that the format knows.",
        "A misspelt key would otherwise be ignored and its default made instead, without a word.",
        "Use the name suggested; `sitscad schema` lists all keys, and editors complete them from it.",
    ),
    SpecRule(
        "SIT003",
        "missing-key",
        "Keys without a sensible default are there: sitscad, name, and the coil's shape, size, "
        "turns, width and spacing.",
        "These decide what the sensor is; nobody can guess them.",
        "Add the key to the section that the finding points at.",
    ),
    SpecRule(
        "SIT004",
        "wrong-type",
        "Every value has the kind that its key asks for: a number, a text, a list or a section.",
        "A value of another kind has no defined meaning.",
        "Write the value as the hint shows; put quotes around a text that looks like a number.",
    ),
    SpecRule(
        "SIT005",
        "wrong-unit",
        "Lengths are millimetres or carry a unit of length; every other dimensional value carries its own unit.",
        "A missing or wrong unit is off by a power of ten and still looks right.",
        "Write the unit after the number: 100 um, 4 mil, 330 pF, 40 MHz, 4.8 N, 300 kPa, 0.3 ohm.",
    ),
    SpecRule(
        "SIT006",
        "out-of-range",
        "Every number is finite and within what a sensor of this kind can have.",
        "Values far outside are slips of unit or sign, and would be carried into the files.",
        "Check the unit and the sign; the finding names the range.",
    ),
    SpecRule(
        "SIT007",
        "unknown-name",
        "Every preset and every choice is one that exists.",
        "A preset stands for figures that are made to; a near miss must not pick another one.",
        "Use one of the names listed, or write the stack-up, rules, jaw or material out in the spec.",
    ),
    SpecRule(
        "SIT008",
        "unknown-version",
        "`sitscad:` names a version of the format that this program reads.",
        "A later format may give the same words another meaning.",
        "Write `sitscad: 1`, or install the version of sitscad that the spec was written for.",
    ),
    SpecRule(
        "SIT009",
        "inconsistent",
        "The values fit each other: layers exist in the stack-up, the shield fits below the board, "
        "sizes fit the shape.",
        "Each value alone is fine, but together they describe nothing that can be made.",
        "Change one of the two values that the finding names.",
    ),
    SpecRule(
        "SIT010",
        "too-large",
        "The file is of a size that a design has: 256 KiB, 4000 values, 12 levels deep.",
        "Larger files are accidents or attacks, and must not cost time or memory.",
        "Check that the right file was given.",
    ),
    SpecRule(
        "SIT011",
        "unreadable-file",
        "The file exists, can be read, and is UTF-8 text.",
        "What cannot be read cannot be checked.",
        "Check the path and the permissions; save the file as UTF-8.",
    ),
    SpecRule(
        "SIT012",
        "duplicate-key",
        "A section holds each key once.",
        "With two values for one key, one of them would be dropped without a word.",
        "Keep the one that is meant.",
    ),
    SpecRule(
        "SIT013",
        "plain-yaml-only",
        "The spec is plain YAML: no anchors, aliases, tags or further documents, and every key is a text.",
        "Anchors and tags hide what a value is from the reader, and let a small file unfold into gigabytes.",
        "Write the value out where it is used.",
    ),
    SpecRule(
        "SIT014",
        "coils-overlap",
        "Neighbouring coils stand at least one trace spacing apart.",
        "Coils that touch are one piece of copper, and the sensor measures nothing.",
        "Increase `array.pitch` by what the finding names, or make the coil smaller.",
    ),
    SpecRule(
        "SIT015",
        "broken-turn",
        "Turns of a polygon are whole sides (a multiple of 1/4, 1/6 or 1/8), turns of a racetrack are halves.",
        "The winding is defined side by side; a part of a side has no definition that two programs would agree on.",
        "Use the nearest number of turns that the finding names.",
    ),
    SpecRule(
        "SIT016",
        "winding-does-not-fit",
        "The turns fit inside the outer size: the innermost trace stays clear of the centre.",
        "More turns than fit would cross the centre and short themselves.",
        "Use at most the number of turns that the finding names, a finer trace and spacing, more "
        "layers, or a larger coil.",
    ),
    SpecRule(
        "SIT017",
        "profile-outside",
        "A fabricator's profile file lies in the spec's folder, or in a folder below it.",
        "A spec that is passed on must not read files from elsewhere on the machine of whoever checks it.",
        "Put the profile beside the spec and write its name alone, like ourshop.yaml.",
    ),
    SpecRule(
        "SIT018",
        "profile-circle",
        "Profile files lead, by based_on, to an installed profile.",
        "Profiles that are based on each other have no first figure.",
        "Base one of the files named on an installed profile, like generic-flex.",
    ),
    SpecRule(
        "SIT019",
        "too-many-turns",
        "The turns of all layers of a coil together are no more than 500, those of all coils no more than 2000.",
        "What an estimate takes grows with the square of the turns: at 400 turns of one coil half a gigabyte of memory "
        "and twenty seconds, beyond these limits gigabytes and minutes. It is refused before anything is computed.",
        "Use fewer turns or layers, or fewer coils; a coil for this converter has some tens of turns.",
    ),
    SpecRule(
        "SIT020",
        "ignore-comment",
        "A comment `# sitscad: ignore` names rules that exist, gives a reason, and silences a finding on its line.",
        "A rule that is silenced without a reason, or for something that has long gone, hides the next fault there.",
        "Write `# sitscad: ignore SIT103 their quotation of 3 May` at the end of the line that the finding points at, "
        "or take the comment out.",
        Severity.WARNING,
    ),
)

RULE_NAMES = {rule.id: rule.name for rule in SPEC_RULES}
