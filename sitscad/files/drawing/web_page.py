"""Building blocks of the HTML pages (report, data sheet, calibration): page, sections, tables, figures, style sheet.

A page is one file that loads nothing from outside. It is laid out for light and dark screens and for paper.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from sitscad.basics.version import __version__


def html_page(title: str, parts: Iterable[str], about: str = "") -> str:
    """Return the HTML of a page. Empty parts are left out; `about` (HTML) follows the version in the footer."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body><main>\n"
        + "\n".join(part for part in parts if part)
        + f"\n<footer>sitscad {escape(__version__)}{about}</footer>\n</main></body></html>\n"
    )


def html_section(title: str, body: str, stage: str = "") -> str:
    """Return the HTML of a section with a title (HTML). Empty if `body` is empty.

    `stage` is the build stage of the section, written as an attribute for scripts.
    """
    named = f' data-stage="{stage}"' if stage else ""
    return f"<section{named}><h2>{title}</h2>{body}</section>" if body else ""


def soft_paragraph(text: str) -> str:
    """Return a paragraph in the lighter colour. Its text is escaped. Empty if the text is empty."""
    return f"<p class='soft'>{escape(text)}</p>" if text else ""


def html_figure(drawing: str, caption: str) -> str:
    """Return the HTML of a drawing (SVG text) on white paper with a caption. The caption is escaped."""
    shown = drawing[drawing.index("<svg") :]
    return f"<figure><div class='paper'>{shown}</div><figcaption>{escape(caption)}</figcaption></figure>"


def aligned_html_table(
    head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[bool], caption: str = ""
) -> str:
    """Return the HTML of a table. Empty if there are no rows.

    Columns with a true entry in `numbers` are aligned right. All texts are escaped.
    """
    if not rows:
        return ""
    kinds = [" class=number" if is_number else "" for is_number in numbers]

    def cells(entries: Sequence[str], tag: str) -> str:
        return "".join(f"<{tag}{kind}>{escape(entry)}</{tag}>" for kind, entry in zip(kinds, entries, strict=True))

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    heading = f"<thead><tr>{cells(head, 'th')}</tr></thead>"
    return f"<div class='scroll'><table>{title}{heading}<tbody>{body}</tbody></table></div>"


def html_list(entries: Iterable[object]) -> str:
    """Return the HTML of a list. Empty if there are no entries. Entries are escaped."""
    items = "".join(f"<li>{escape(str(entry))}</li>" for entry in entries)
    return f"<ul class='columns'>{items}</ul>" if items else ""


STYLE = """
:root {
  color-scheme: light dark;
  --ink: #1c2126; --soft: #5c6670; --line: #d9dee3; --ground: #fbfbfa; --card: #ffffff; --code: #f3f4f2;
  --error: #b3261e; --warning: #8a5a00; --note: #1f5f8b; --good: #1e6b3a;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ink: #e6e8ea; --soft: #9aa4ad; --line: #353c43; --ground: #15181b; --card: #1d2125; --code: #262b30;
    --error: #ff8a80; --warning: #f0b959; --note: #7fc0ee; --good: #7fd19b;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0; background: var(--ground); color: var(--ink);
  font: 16px/1.5 "Helvetica Neue", Helvetica, Arial, sans-serif;
}
main { max-width: 62rem; margin: 0 auto; padding: 2.5rem 1.5rem 4rem; }
h1 { font-size: 2rem; margin: 0; letter-spacing: -.01em; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 3rem 0 .8rem; padding-bottom: .3rem; border-bottom: 1px solid var(--line); }
p, ul { margin: .5rem 0; }
ul { padding-left: 1.2rem; }
.soft, figcaption, caption, footer { color: var(--soft); }
.bad { color: var(--error); }
.good { color: var(--good); }
.warned { color: var(--warning); }
.signal { margin: .2rem 0; font-weight: 600; font-variant-numeric: tabular-nums; }
.verdict {
  display: inline-block; margin: .8rem 0 .3rem; padding: .25rem .8rem;
  border: 2px solid currentColor; border-radius: 1rem; font-weight: 600;
}
.banner { margin: 1.2rem 0; padding: .8rem 1rem; border: 2px solid; color: var(--error); font-weight: 600; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: .8rem; margin: 1.5rem 0; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: .4rem; padding: .7rem; }
.tile b { display: block; font-size: .95rem; white-space: nowrap; font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: .85rem; }
.finding {
  margin: .8rem 0; padding: .7rem 1rem; break-inside: avoid; background: var(--card);
  border: 1px solid var(--line); border-left: 4px solid var(--note); border-radius: .3rem;
}
.finding > summary { cursor: pointer; overflow-wrap: anywhere; }
.finding:not([open]) > summary { white-space: nowrap; overflow: hidden; text-overflow: ellipsis; }
.finding.error { border-left-color: var(--error); }
.finding.warning { border-left-color: var(--warning); }
.finding p { margin: .35rem 0; overflow-wrap: anywhere; }
a { color: inherit; }
.kind { font-weight: 700; color: var(--note); }
.error .kind { color: var(--error); }
.warning .kind { color: var(--warning); }
pre {
  margin: .5rem 0; padding: .45rem .7rem; background: var(--code); border-radius: .25rem;
  font: .85rem/1.5 ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace;
  white-space: pre-wrap; overflow-wrap: anywhere;
}
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; margin: .6rem 0; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding-bottom: .3rem; font-size: .9rem; }
th, td { text-align: left; vertical-align: baseline; padding: .35rem .8rem .35rem 0;
  border-bottom: 1px solid var(--line); }
th { color: var(--soft); font-weight: 600; font-size: .85rem; }
.number { text-align: right; white-space: nowrap; }
figure { margin: 1rem 0; break-inside: avoid; }
figure > svg, .paper > svg { display: block; width: 100%; height: auto; }
.paper { background: #ffffff; border: 1px solid var(--line); border-radius: .4rem; padding: .4rem; }
.narrow { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(24rem, 100%), 1fr)); gap: 0 1rem; }
figcaption { font-size: .9rem; margin-top: .3rem; }
.section text { fill: var(--ink); font-size: 13px; font-family: inherit; }
.section .leader { stroke: var(--soft); stroke-width: 1; }
.section .layer { stroke: var(--ink); }
.stale { opacity: .45; }
.live { position: fixed; inset: auto 0 0 0; max-height: 30vh; overflow: auto; z-index: 1; margin: 0; font-weight: 400;
  background: var(--card); color: var(--ink); }
.live button { float: right; margin-left: 1rem; position: sticky; top: 0; }
[hidden] { display: none !important; }
.bar { display: flex; flex-wrap: wrap; gap: .4rem 1rem; align-items: center; margin: .5rem 0; font-size: .9rem; }
.bar label, .inputs label { display: inline-flex; align-items: center; gap: .35rem; }
fieldset.bar { border: 1px solid var(--line); border-radius: .4rem; padding: .3rem .7rem; }
button, select { font: inherit; color: inherit; background: var(--card); border: 1px solid var(--soft);
  border-radius: .3rem; padding: .15rem .6rem; cursor: pointer; }
button[aria-pressed="true"] { background: var(--note); color: var(--ground); }
:focus-visible { outline: 3px solid var(--note); outline-offset: 2px; }
.stage { position: relative; }
.stage canvas { display: block; width: 100%; height: min(60vh, 32rem); touch-action: none; background: var(--card);
  border: 1px solid var(--line); border-radius: .4rem; cursor: grab; }
.marks { position: absolute; inset: 0; pointer-events: none; overflow: hidden; }
.marks i { position: absolute; transform: translate(-50%, -50%); width: 1.3em; height: 1.3em; border-radius: 50%;
  background: var(--error); color: var(--ground); font: 700 .7rem/1.3em inherit; text-align: center; }
.inputs { display: grid; grid-template-columns: repeat(auto-fit, minmax(21rem, 1fr)); gap: .4rem 1.5rem; }
.inputs label { white-space: nowrap; }
.inputs input { flex: 1; min-width: 6rem; }
.inputs output { min-width: 5.5em; text-align: right; font-variant-numeric: tabular-nums; }
.cuts { display: grid; grid-template-columns: repeat(auto-fit, minmax(18rem, 1fr)); gap: 1rem; margin: .8rem 0; }
.cut { width: 100%; touch-action: none; cursor: move; background: var(--card); border: 1px solid var(--line);
  border-radius: .4rem; }
.cut text { fill: var(--soft); font-size: 11px; }
.cut .board { fill: #d9a441; } .cut .copper { fill: #a8541c; } .cut .pad { fill: #a9cfe0; }
.cut .plate { fill: #8a929a; }
footer { margin-top: 4rem; font-size: .85rem; overflow-wrap: anywhere; }
@media (max-width: 40rem) {
  main { padding: 1.2rem .8rem 3rem; }
  table { font-size: .75rem; }
  caption, th { font-size: .75rem; }
  th, td { padding-right: .45rem; overflow-wrap: anywhere; }
  th:last-child, td:last-child { padding-right: 0; }
  .number { white-space: normal; }
  .inputs, .cuts { grid-template-columns: 1fr; }
  .live { max-height: 20vh; }
}
@media print {
  :root {
    --ink: #000; --soft: #444; --line: #bbb; --ground: #fff; --card: #fff; --code: #f4f4f4;
    --error: #b3261e; --warning: #8a5a00; --note: #1f5f8b; --good: #1e6b3a;
  }
  @page { size: A4; margin: 10mm; }
  :root { font-size: 8.3pt; }
  body { font-size: 1rem; line-height: 1.25; }
  main { max-width: none; padding: 0; }
  h2 { break-after: avoid; margin: 1.2rem 0 .3rem; }
  tr, .tile { break-inside: avoid; }
  caption { break-after: avoid; padding-bottom: .1rem; }
  th, td { padding: .1rem .6rem .1rem 0; }
  table { margin: .3rem 0; }
  p, ul { margin: .2rem 0; }
  .tiles { grid-template-columns: repeat(6, 1fr); gap: .4rem; margin: .6rem 0; }
  .tile, .finding { padding: .3rem .6rem; }
  .finding { margin: .4rem 0; }
  .finding p, pre { margin: .15rem 0; padding-top: 0; padding-bottom: 0; }
  .scroll { overflow: visible; }
  .columns { columns: 2; column-gap: 1.2rem; }
  .columns table { font-size: .78rem; }
  figure { margin: .3rem 0; }
  figure > svg, .paper > svg { max-height: 128mm; }
  .paper { padding: 0; }
  .section { max-height: 80mm; }
  footer { margin-top: 1rem; }
  .bar, #pushed, #solids, [data-without] { display: none !important; }
  .finding:not([open]) > summary { white-space: normal; }
}
"""
