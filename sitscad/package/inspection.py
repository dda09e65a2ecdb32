"""Check of one spec file under its configuration: findings, pictures, and the spec's text with fixes applied."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable
from dataclasses import replace

from sitscad.basics.finding import Finding, Remedy, Severity
from sitscad.basics.late import late
from sitscad.basics.record import record
from sitscad.checks.findings import CheckedSpec, checked_spec
from sitscad.checks.fixes.mending import AppliedFix, UndoneFix, mended_text
from sitscad.checks.fixes.search import DECISIVE
from sitscad.checks.judging import CheckResult, all_rules
from sitscad.checks.judging import apply_rules as reviewed
from sitscad.checks.opening import check_unreadable, nearest_policy_of_spec, open_spec
from sitscad.checks.policy import Baseline, Policy, apply_policy, make_ignored_test, selected_rules
from sitscad.estimates.design import Design
from sitscad.spec.load import load_text, read_text
from sitscad.spec.reading import SpecError, decode_text
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource

# pictures load shapely
board_picture = late("sitscad.package.check_pictures", "board_picture")
fit_drawing = late("sitscad.package.check_pictures", "fit_drawing")


@record
class Inspection:
    """Result of checking a spec.

    ``picture`` is the board drawn in characters, and ``drawing`` shows the parts that do not fit, as SVG. Both are
    empty if they are not requested or not possible.
    """

    checked: CheckedSpec
    picture: str = ""
    drawing: str = ""


@record
class CheckOptions:
    """Options of a check, in addition to comments in the spec and to the configuration file nearest to it.

    ``select`` and ``ignore`` are patterns of rule ids or names. ``baseline`` holds findings that are already known.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    baseline: Baseline | None = None


ALL = CheckOptions()
"""Options for all rules, without a baseline."""


def inspect(
    path: str, hints: str = DECISIVE, options: CheckOptions = ALL, draws: bool = False, draws_fit: bool = False,
    least: Severity = Severity.NOTE,
) -> Inspection:
    """Load and check one spec (``-`` is standard input). A spec that cannot be read has findings on the faults.

    Parameters
    ----------
    path : str
        path of the spec
    hints : str
        limit on the changes that are tried for hints, as in `check`
    options : CheckOptions
        rules and baseline
    draws, draws_fit : bool
        whether to draw the board in characters, and the parts that do not fit
    least : Severity
        lowest severity of findings for which changes are tried

    Raises
    ------
    PolicyError
        if the configuration cannot be used
    """
    policy = nearest_policy_of_spec(path)
    try:
        spec = open_spec(path, policy)
    except SpecError as error:
        return Inspection(check_unreadable(path, error, hints))
    # If a configuration changes severities, a note may be shown as an error
    return _inspect_spec(spec, hints, policy, options, draws, draws_fit, Severity.NOTE if policy.severity else least)


def inspect_text(text: str, path: str, hints: str = DECISIVE, options: CheckOptions = ALL) -> Inspection:
    """Check the text of a spec as if it were the content of the file at `path`. Parameters are as for `inspect`."""
    plain = decode_text(text.encode("utf-8"))
    policy = nearest_policy_of_spec(path)
    try:
        spec = load_text(plain, path, policy.profiles)
    except SpecError as error:
        return Inspection(check_unreadable(path, error, hints, plain))
    return _inspect_spec(spec, hints, policy, options)


def _inspect_spec(
    spec: SensorSpec, hints: str, policy: Policy, options: CheckOptions, draws: bool = False, draws_fit: bool = False,
    least: Severity = Severity.NOTE,
) -> Inspection:
    """Return the result of checking a spec under a policy, with its pictures if requested."""
    design = Design(spec)
    is_ignored = make_ignored_test(spec.source, all_rules(), policy, options.select, options.ignore)
    checked = _configured_check(spec.name, spec.source, reviewed(design, hints, least, is_ignored))
    selected = selected_rules(all_rules(), options.select, options.ignore)
    left_out = [rule.id for rule in all_rules() if rule.id not in selected]
    checked = checked.without(left_out, "left out by --select or --ignore") if left_out else checked
    checked = apply_policy(checked, spec.source, all_rules(), policy, options.baseline)
    picture = board_picture(design.layout, checked) if draws else ""
    return Inspection(checked, picture, fit_drawing(design.layout, checked) if draws_fit else "")


def as_configured(spec: SensorSpec, result: CheckResult, policy: Policy | None = None) -> CheckedSpec:
    """Return the result of a check with severities and exceptions from the configuration and the spec's comments.

    `policy` is the configuration; None for the file nearest to the spec in its folder or the folders above.
    """
    checked = _configured_check(spec.name, spec.source, result)
    return apply_policy(checked, spec.source, all_rules(), policy or nearest_policy_of_spec(spec.source.path))


def _configured_check(name: str, source: SpecSource, result: CheckResult) -> CheckedSpec:
    return checked_spec(
        name, source, result.findings, result.not_checked, result.signals, result.fit, result.closing,
        result.reached, result.board,
    )


@record(eq=False)
class MendedSpec:
    """A spec whose findings were fixed automatically.

    ``before`` and ``after`` are its texts, and ``inspection`` is the check of the new text. ``applied`` lists the fixes
    in order. ``rolled_back`` lists fixes that were tried and undone. The new findings do not offer them again.
    """

    path: str
    before: str
    after: str
    inspection: Inspection
    applied: tuple[AppliedFix, ...] = ()
    rolled_back: tuple[UndoneFix, ...] = ()

    @property
    def diff(self) -> str:
        """Difference between the two texts as a patch. Empty if they are equal."""
        before, after = (re.findall(r"[^\n]*\n|[^\n]+", text) for text in (self.before, self.after))
        patch = difflib.unified_diff(before, after, self.path, self.path)
        return "".join(line if line.endswith("\n") else f"{line}\n{NO_LINE_END}\n" for line in patch)

    @property
    def fixes_text(self) -> str:
        """Text of the applied fixes, one line per fix."""
        return "\n".join(
            f"{fix.finding.rule} mended: {'; '.join(edit.words for edit in fix.remedy.edits)}"
            + (f"; worse than before: {', '.join(fix.worsens)}" if fix.worsens else "")
            for fix in self.applied
        )

    @property
    def undone_fixes_text(self) -> str:
        """Text of the fixes that were undone, one line per fix, each with the reason."""
        lines = (
            f"{fix.finding.rule} not mended by {'; '.join(edit.words for edit in fix.remedy.edits)}: {fix.why}"
            for fix in self.rolled_back
        )
        return "\n".join(dict.fromkeys(lines))

    @property
    def unfixed_rules_text(self) -> str:
        """Line with the rules of errors and warnings for which no fix is known. Empty if there are none."""
        grave = (each for each in self.inspection.checked.findings if each.severity.is_at_least(Severity.WARNING))
        undone = {each.finding.rule for each in self.rolled_back}
        without = sorted({each.rule for each in grave if not each.fixes} - undone)
        return f"no fix is known for {', '.join(without)} (check -v has hints)" if without else ""


NO_LINE_END = "\\ No newline at end of file"


def mend(
    path: str, may: Callable[[Finding, Remedy], bool], hints: str = DECISIVE, options: CheckOptions = ALL,
    progress: Callable[[str], None] = lambda step: None,
) -> MendedSpec:
    """Return a spec with every allowed fix that reduces its findings. Nothing is written.

    Parameters
    ----------
    path : str
        path of the spec; ``-`` is standard input
    may : callable
        returns whether a fix of a finding is allowed
    hints : str
        limit on the changes that are tried, as in `check`
    options : CheckOptions
        rules and baseline
    progress : callable
        called with a text on each step

    Notes
    -----
    A file that cannot be read as text is checked, but not fixed.
    """
    try:
        text = read_text(path)
    except SpecError as error:
        return MendedSpec(path, "", "", Inspection(check_unreadable(path, error, hints)))

    def said(of: str) -> CheckedSpec:
        return inspect_text(of, path, hints, options).checked

    def verdict(of: str) -> CheckedSpec:
        return inspect_text(of, path, "none", options).checked

    result = mended_text(text, said, may, verdict, progress)
    failed = [undone.remedy for undone in result.rolled_back if not undone.remedy.new_warnings]
    findings = (replace(each, fixes=tuple(fix for fix in each.fixes if fix not in failed))
                for each in result.check_result.findings)
    said_last = replace(result.check_result, findings=tuple(findings)) if failed else result.check_result
    return MendedSpec(path, text, result.text, Inspection(said_last), result.applied, result.rolled_back)
