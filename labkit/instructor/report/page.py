"""What all pages have in common: a single file that reads well in any theme, at any width and on paper."""

import hashlib
import html
import re
import unicodedata

TITLE, LINE, SENTENCE, ANSWER, RUBRIC = 200, 400, 2000, 5000, 20000  # characters of one text that are shown
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"

# Control characters, those that turn the text around them, and half characters, which no file can hold.
_ODD = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\U000e0000-\U000e007f"
    "\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\uffff]"
)
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d|conin|conout)", re.IGNORECASE)  # names of Windows

STYLE = """
:root { color-scheme: light dark; --fore: #1b1f24; --back: #ffffff; --soft: #57606a; --line: #d0d7de;
  --card: #f4f6f8; --good: #00609a; --bad: #a03c00; --wait: #6b5300; --bar: #0072b2; }
@media (prefers-color-scheme: dark) { :root { --fore: #e6e8eb; --back: #14171c; --soft: #a7afb9;
  --line: #3b424c; --card: #1e232a; --good: #76c2f5; --bad: #ff9f63; --wait: #e6c25c; --bar: #56b4e9; }
  }
* { box-sizing: border-box; }
body { font: 1rem/1.5 system-ui, sans-serif; color: var(--fore); background: var(--back);
  max-width: 48rem; margin: 0 auto; padding: 2rem 1rem 4rem; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: 0 0 .3rem; text-wrap: balance; }
h2 { font-size: 1.2rem; line-height: 1.3; margin: 2.5rem 0 .6rem; break-after: avoid; }
h3 { font-size: 1rem; margin: 0; }
p, ul, figure { margin: .5rem 0; } ul { padding-left: 1.2rem; }
.soft, caption, figcaption, th { color: var(--soft); } .small { font-size: .875rem; } figcaption {
  margin-top: .5rem; }
.points { font-size: 1.2rem; margin: 1rem 0; } .points b { font-size: 2rem; line-height: 1.2; }
code, pre, .line { font-family: ui-monospace, Menlo, Consolas, monospace; font-size: .875em; }
code { background: var(--card); border-radius: 3px; padding: 0 .2em; }

.checks { list-style: none; padding: 0; margin: .5rem 0; border-bottom: 1px solid var(--line); }
.check { display: grid; grid-template-columns: 7.5rem minmax(0, 1fr) auto; gap: 0 .8rem;
  align-items: baseline; border-top: 1px solid var(--line); padding: .6rem 0; }
.word { font-weight: 600; white-space: nowrap; } .sign { display: inline-block; width: 1.4em; }
.good .word { color: var(--good); } .bad .word { color: var(--bad); } .wait .word { color: var(--wait);
  }
.sum { white-space: nowrap; text-align: right; font-variant-numeric: tabular-nums; }
.told { grid-column: 2 / -1; min-width: 0; }
.tag { display: inline-block; font-size: .8rem; font-weight: 400; border: 1px solid var(--soft);
  border-radius: 3px; padding: 0 .35em; color: var(--soft); white-space: nowrap; }
.box { background: var(--card); border-radius: 4px; padding: .5rem .7rem; margin: .5rem 0;
  overflow: auto; }
.text { white-space: pre-wrap; } .lines { font-size: .9375rem; }
.line { display: block; white-space: pre-wrap; padding-left: 12ch; text-indent: -12ch;
  min-height: 1.5em; }
.problem { border-left: 4px solid var(--bad); padding-left: .8rem; margin: 1.2rem 0; }

.scroll { overflow-x: auto; position: relative; } .scroll img { display: block; width: 100%;
  min-width: 34rem; height: auto; background: #fff; border-radius: 4px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { overflow-wrap: break-word; text-align: left; vertical-align: baseline;
  padding: .3rem .8rem .3rem 0; border-bottom: 1px solid var(--line); }
th { font-size: .875rem; font-weight: 600; } td:last-child, th:last-child { padding-right: 0; }
tr { break-inside: avoid; } .n { text-align: right; white-space: nowrap; } .nowrap {
  white-space: nowrap; }
tbody th { color: inherit; font-size: inherit; font-weight: 400; }
.grow { min-width: 11rem; } .track { min-width: 5rem; width: 25%; }
.bar { display: block; height: .7rem; background: var(--bar); border-radius: 2px;
  print-color-adjust: exact; }
svg { display: block; width: 100%; height: auto; font-size: 13px; } svg rect {
  fill: var(--bar); print-color-adjust: exact; }
svg text { fill: var(--fore); text-anchor: middle; } svg .soft { fill: var(--soft); } svg line {
  stroke: var(--line); }
.marks { letter-spacing: .2em; white-space: nowrap; }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%);
  white-space: nowrap; }
a { color: var(--good); text-underline-offset: .15em; } summary { cursor: pointer; } :focus-visible {
  outline: 2px solid var(--good); }
@media (max-width: 34rem) { .check { grid-template-columns: minmax(0, 1fr) auto; } .check h3 {
  grid-row: 2; grid-column: 1 / -1; } .told { grid-column: 1 / -1; } }
@media print { @page { margin: 18mm; } :root { color-scheme: light; --bar: #0072b2; --fore: #000;
  --back: #fff; --soft: #444; --line: #bbb; --card: #fff; --good: #00609a; --bad: #a03c00;
  --wait: #6b5300; } body { max-width: none; padding: 0; font-size: 10.5pt; } .box { max-height: none;
  border: 1px solid var(--line); } .check, figure { break-inside: avoid; } .check.long {
  break-inside: auto; } .scroll img, svg { min-width: 0; } a { color: inherit; }
  details::details-content { content-visibility: visible; block-size: auto; } }
"""


def page(title, *parts):
    """The HTML text of a page; parts are HTML already."""
    body = "\n".join(filter(None, parts))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{text(title, 2 * TITLE)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


def text(raw, longest=SENTENCE):
    """Anybody's text as HTML: escaped, cut, and without characters that act instead of being read."""
    raw = str(raw)
    return html.escape(_ODD.sub("", raw[:longest])) + ("…" if len(raw) > longest else "")


def prose(raw, longest=SENTENCE):
    """The same for a sentence, in which `backticks` mark code."""
    return re.sub(r"`([^`\n]{1,200})`", r"<code>\1</code>", text(raw, longest))


def name(raw):
    """A person's name, which may run from right to left without turning the text around it."""
    return f"<bdi>{text(raw, TITLE)}</bdi>"


def box(raw, longest=ANSWER, label="text"):
    """A long text as it was typed; it scrolls, also by keyboard, and says what is cut away."""
    raw = str(raw)
    rest = len(raw) - longest
    more = f'<p class="soft small">(cut here: {rest:,} more characters)</p>' if rest > 0 else ""
    shown = text(raw[:longest], longest)
    return f'<div class="box text" dir="auto" {region(label)}>{shown}</div>{more}'


def region(label):
    """Attributes of what scrolls: it can be reached by keyboard and has a name."""
    return f'tabindex="0" role="region" aria-label="{label}"'


def number(value):
    """Points as people write them: '3', '2.5'."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def counted(count, noun):
    """'1 student', '2.5 points'."""
    return f"{number(count)} {noun}{'' if count == 1 else 's'}"


def file_name(label, taken):
    """A file name for a student's page, safe everywhere and not in the set `taken`, to which it is added.

    Letters of all scripts stay as they are; what could be a path, an ending or a device does not.
    """
    raw = str(label)
    plain = unicodedata.normalize("NFKC", _ODD.sub("", raw[:1000]))
    kept = "".join(c if unicodedata.category(c)[0] in "LMN" else "-" for c in plain)
    stem = _short(re.sub("-+", "-", kept).strip("-"))
    if not stem or _RESERVED.fullmatch(stem):
        stem = f"student-{stem}".rstrip("-")
    digest, tries = hashlib.sha256(raw.encode("utf-8", "surrogatepass")).hexdigest(), 0
    found = stem
    while found.casefold() in taken:
        tries += 1
        found = f"{stem}-{digest[:8]}" + (f"-{tries}" if tries > 1 else "")
    taken.add(found.casefold())
    return f"{found}.html"


def _short(stem, characters=60, octets=180):
    """At most so many characters, and so many bytes in UTF-8, which is what file systems count."""
    return stem[:characters].encode("utf-8")[:octets].decode("utf-8", "ignore").strip("-")
