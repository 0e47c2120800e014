"""What all pages have in common: one self-contained HTML file, readable in light, dark, narrow and on paper."""

import hashlib
import html
import re
import unicodedata

LONGEST = 5000  # characters of a student's text on a page
_CUT = "\n… (cut here)"
# What would turn the direction of the text around it, and control characters.
_ODD = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}

STYLE = """
:root { color-scheme: light dark; --fore: #1b1b1b; --back: #ffffff; --soft: #595959; --line: #d5d5d5; --card: #f6f6f4;
  --good: #1a6b3c; --bad: #a3350f; --wait: #6b4e00; --bar: #0072b2; }
@media (prefers-color-scheme: dark) { :root { --fore: #e8e8e8; --back: #161616; --soft: #ababab; --line: #444; --card: #222;
  --good: #7ed3a1; --bad: #ff9f7a; --wait: #e8c25a; --bar: #56b4e9; } }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--fore); background: var(--back); max-width: 52rem;
  margin: 0 auto; padding: 1.5rem 1rem 4rem; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 0 0 .25rem; } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; }
h3 { font-size: 1rem; margin: 0; } p { margin: .4rem 0; } .soft { color: var(--soft); }
.points { font-size: 1.25rem; } .points b { font-size: 1.6rem; }
article { border: 1px solid var(--line); border-left: 5px solid var(--line); border-radius: 4px; padding: .5rem .8rem;
  margin: .5rem 0; break-inside: avoid; }
article.good { border-left-color: var(--good); } article.bad { border-left-color: var(--bad); }
article.wait { border-left-color: var(--wait); }
.head { display: flex; gap: .2rem .8rem; flex-wrap: wrap; align-items: baseline; }
.head .word { font-weight: 600; min-width: 5.5rem; } .good .word { color: var(--good); } .bad .word { color: var(--bad); }
.wait .word { color: var(--wait); } .head .sum { margin-left: auto; white-space: nowrap; }
pre { font: 13px/1.45 ui-monospace, monospace; background: var(--card); padding: .5rem .7rem; border-radius: 4px;
  overflow-x: auto; white-space: pre-wrap; margin: .5rem 0 .2rem; }
.answer { white-space: pre-wrap; background: var(--card); padding: .5rem .7rem; border-radius: 4px; margin: .5rem 0 .2rem; }
.tag { font-size: .8rem; border: 1px solid var(--line); border-radius: 3px; padding: 0 .35rem; color: var(--soft); }
img { max-width: 100%; height: auto; background: #fff; border-radius: 4px; }
table { border-collapse: collapse; width: 100%; } th, td { text-align: left; padding: .25rem .6rem .25rem 0;
  border-bottom: 1px solid var(--line); vertical-align: top; } td.n, th.n { text-align: right; white-space: nowrap; padding-right: 1rem; }
.bar { display: inline-block; height: .7rem; background: var(--bar); border-radius: 2px; vertical-align: baseline; }
.track { width: 100%; min-width: 4rem; background: var(--card); border-radius: 2px; line-height: .7rem; }
.wide { overflow-x: auto; } a { color: var(--bar); }
@media print { body { max-width: none; padding: 0; } }
"""

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def page(title, *parts):
    """The HTML text of a page; parts are HTML already."""
    body = "\n".join(parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{text(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def text(raw, longest=LONGEST):
    """Anybody's text as HTML: escaped, cut, and without characters that act instead of being read."""
    raw = str(raw)
    cut = _CUT if len(raw) > longest else ""
    return html.escape(_ODD.sub("", raw[:longest])) + cut


def number(value):
    """Points as people write them: '3', '2.5'."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def counted(count, word):
    """'1 student', '3 students'."""
    return f"{count} {word}{'' if count == 1 else 's'}"


def file_name(label, taken):
    """A file name for a student's page that is safe everywhere and not in the set `taken`, to which it is added."""
    name = unicodedata.normalize("NFC", _ODD.sub("", str(label)))
    name = re.sub(r"[^\w .()-]", "_", name).strip(" .")[:60].strip(" .") or "student"
    if name.split(".")[0].casefold() in _RESERVED or name != str(label) or name.casefold() in taken:
        name += "-" + hashlib.sha256(str(label).encode("utf-8", "replace")).hexdigest()[:8]
    while name.casefold() in taken:
        name += "-2"
    taken.add(name.casefold())
    return f"{name}.html"
