"""A spec as a path leads to it, checked and judged: what it is judged by, whether it could be read or not, its
picture, and its text with fixes written into it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from sitscad.basics.finding import Finding, NotChecked, Remedy, Severity
from sitscad.basics.record import record
from sitscad.checks.findings import CheckedSpec, checked_spec, numbered_places
from sitscad.checks.fixes.mending import Applied, RolledBack, mended_text
from sitscad.checks.fixes.search import DECISIVE
from sitscad.checks.judging import CheckResult, all_rules, mended
from sitscad.checks.judging import judged as reviewed
from sitscad.checks.opening import STDIN, beginning, opened, policy_for
from sitscad.checks.policy import Baseline, Policy, chosen_rules, ignored_anyway, judged
from sitscad.estimates.design import Design
from sitscad.spec.load import load_text, read_text
from sitscad.spec.reading import SpecError, decoded
from sitscad.spec.sensor import SensorSpec


@record
class Inspection:
    """One spec after its checks; ``picture`` is its board in letters, ``drawing`` what does not fit as SVG; both are
    empty where none is asked for or possible.
    """

    checked: CheckedSpec
    picture: str = ""
    drawing: str = ""


@record
class CheckOptions:
    """What a spec is checked by beside its comments and the nearest configuration: patterns of rules that are selected
    or ignored, and what was known before.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    baseline: Baseline | None = None


ALL = CheckOptions()
"""All rules, and nothing known before."""


def inspect(
    path: str, hints: str = DECISIVE, options: CheckOptions = ALL, draws: bool = False, draws_fit: bool = False,
    least: Severity = Severity.NOTE,
) -> Inspection:
    """Load, check and judge one spec (``-`` is standard input); what keeps it from being read is a finding too.

    `hints` is what is tried for hints, as in `check`; `draws` asks for the board in letters, `draws_fit` for the
    drawing of what does not fit; nothing is tried for findings milder than the `least`, whose hints nobody reads.
    Raises `PolicyError` for a configuration that cannot be used.
    """
    policy = policy_for(path)
    try:
        spec = opened(path, policy)
    except SpecError as error:
        return Inspection(unreadable(path, error, hints))
    # where a configuration gives rules other weights, a note may be shown as an error
    return _inspected(spec, hints, policy, options, draws, draws_fit, Severity.NOTE if policy.severity else least)


def inspect_text(text: str, path: str, hints: str = DECISIVE, options: CheckOptions = ALL) -> Inspection:
    """Check a spec's text as it would stand at a path."""
    plain = decoded(text.encode("utf-8"))
    policy = policy_for(path)
    try:
        spec = load_text(plain, path, policy.profiles)
    except SpecError as error:
        return Inspection(unreadable(path, error, hints, plain))
    return _inspected(spec, hints, policy, options)


def _inspected(
    spec: SensorSpec, hints: str, policy: Policy, options: CheckOptions, draws: bool = False, draws_fit: bool = False,
    least: Severity = Severity.NOTE,
) -> Inspection:
    """One spec checked under a policy, with its pictures where they are wanted."""
    design = Design(spec)
    is_ignored = ignored_anyway(spec.source, all_rules(), policy, options.select, options.ignore)
    checked = _checked(spec, reviewed(design, hints, least, is_ignored))
    wanted = chosen_rules(all_rules(), options.select, options.ignore)
    left_out = [rule.id for rule in all_rules() if rule.id not in wanted]
    checked = checked.without(left_out, "left out by --select or --ignore") if left_out else checked
    checked = judged(checked, spec.source, all_rules(), policy, options.baseline)
    drawn, picture = fit_drawing(design, checked) if draws_fit else "", ""
    if draws:  # the board in letters with the findings' numbers at their places
        from sitscad.files.drawing.pictures.layout_picture import PicturePoint, dot_picture

        numbered = ((number, finding.place) for number, finding in numbered_places(checked.findings))
        marks = [PicturePoint(place.x, place.y, str(number), "") for number, place in numbered if place is not None]
        picture = dot_picture(design.layout, marks)
    return Inspection(checked, picture, drawn)


def as_configured(spec: SensorSpec, result: CheckResult, policy: Policy | None = None) -> CheckedSpec:
    """What a check found in a spec, judged by a policy (by default that of the nearest configuration above it) and by
    its comments.
    """
    return judged(_checked(spec, result), spec.source, all_rules(), policy or policy_for(spec.source.path))


def _checked(spec: SensorSpec, result: CheckResult) -> CheckedSpec:
    return checked_spec(
        spec, result.findings, result.not_checked, result.signals, result.fit, result.closing, result.reached,
        result.board,
    )


def fit_drawing(design: Design, checked: CheckedSpec) -> str:
    """Why it does not fit, as SVG, without CAD: the closed pair of jaws cut open, what is too much in red beside its
    limit, and views of what fails elsewhere. Where it fits, the jaws with their dimensions; without a jaw, what lies on
    the board from above; empty where there is none of these, or shield and standoff contradict each other.
    """
    from sitscad.assembly.places.jaws import PartsError
    from sitscad.files.documents.drawings import fit, jaw, plan_view
    from sitscad.files.drawing.svg import svg  # nobody else draws

    grave = [finding for finding in checked.findings if finding.severity.weighs(Severity.WARNING)]
    forced, layout = not checked.is_orderable, design.layout
    try:
        sheet = fit.drawing(layout, grave, forced) or jaw.drawing(layout, forced)
    except PartsError:
        return ""
    sheet = sheet or plan_view.drawing(layout, forced)
    return "" if sheet is None else svg(sheet)


@record(eq=False)
class MendedSpec:
    """A spec with the fixes of its findings written into it: its text before and after, what is said of it then, the
    fixes, in the order in which they were made, and those that were tried and rolled back (its findings have them no
    more).
    """

    path: str
    before: str
    after: str
    inspection: Inspection
    applied: tuple[Applied, ...] = ()
    rolled_back: tuple[RolledBack, ...] = ()

    @property
    def diff(self) -> str:
        """The difference of both texts as a patch; empty where there is none."""
        import difflib  # only those who ask

        before, after = (re.findall(r"[^\n]*\n|[^\n]+", text) for text in (self.before, self.after))
        found = difflib.unified_diff(before, after, self.path, self.path)
        return "".join(line if line.endswith("\n") else f"{line}\n{NO_LINE_END}\n" for line in found)

    @property
    def words(self) -> str:
        """What was mended, a line a fix."""
        return "\n".join(
            f"{one.finding.rule} mended: {'; '.join(edit.words for edit in one.remedy.edits)}"
            + (f"; worse than before: {', '.join(one.worsens)}" if one.worsens else "")
            for one in self.applied
        )

    @property
    def words_of_rolled_back(self) -> str:
        """What was not written, a line a fix, each with the reason."""
        lines = (
            f"{one.finding.rule} not mended by {'; '.join(edit.words for edit in one.remedy.edits)}: {one.why}"
            for one in self.rolled_back
        )
        return "\n".join(dict.fromkeys(lines))

    @property
    def words_of_unmended(self) -> str:
        """What errors and warnings there is no fix for, in a line."""
        grave = (one for one in self.inspection.checked.findings if one.severity.weighs(Severity.WARNING))
        without = sorted({one.rule for one in grave if not one.fixes} - {one.finding.rule for one in self.rolled_back})
        return f"no fix is known for {', '.join(without)} (check -v has hints)" if without else ""


NO_LINE_END = "\\ No newline at end of file"


def mend(
    path: str, may: Callable[[Finding, Remedy], bool], hints: str = DECISIVE, options: CheckOptions = ALL,
    progress: Callable[[str], None] = lambda step: None,
) -> MendedSpec:
    """A spec with every fix that may be made, and makes it better; nothing is written. A path of ``-`` is standard
    input. One that is no text is only inspected. `progress` is called with each step, in words.
    """
    try:
        text = read_text(path)
    except SpecError as error:
        return MendedSpec(path, "", "", Inspection(unreadable(path, error, hints)))

    def said(of: str) -> CheckedSpec:
        return inspect_text(of, path, hints, options).checked

    def verdict(of: str) -> CheckedSpec:
        return inspect_text(of, path, "none", options).checked

    found = mended_text(text, said, may, verdict, progress)
    tried = [one.remedy for one in found.rolled_back if not one.remedy.brings]
    left = (replace(each, fixes=tuple(fix for fix in each.fixes if fix not in tried)) for each in found.said.findings)
    said_last = replace(found.said, findings=tuple(left)) if tried else found.said
    return MendedSpec(path, text, found.text, Inspection(said_last), found.applied, found.rolled_back)


def unreadable(path: str, error: SpecError, hints: str = DECISIVE, text: str | None = None) -> CheckedSpec:
    """The findings of a spec that could not be loaded; every other rule is listed as not checked. Its text is read from
    its file unless it is given.
    """
    reported = {finding.rule for finding in error.findings}
    skipped = (rule.id for rule in all_rules() if rule.id not in reported)
    not_checked = tuple(NotChecked(rule, "the spec could not be read") for rule in skipped)
    known = error.source.text if error.source is not None else ""
    shown = text if text is not None else known if path == STDIN else beginning(path)
    return CheckedSpec(path, shown, mended(error, hints), not_checked, error.texts)
