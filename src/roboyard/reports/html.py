"""HTML building blocks of the pages: style, embedded pictures, tables; all text from outside is escaped."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

STYLE = """
:root{--text:#1c2430;--dim:#5b6675;--line:#dde2e8;--back:#fff;--card:#f6f8fa;--good:#23803a;--bad:#b51d1d;
--look:#b26200;--note:#1f5fae}
@media(prefers-color-scheme:dark){:root{--text:#dfe5ec;--dim:#98a4b3;--line:#333c47;--back:#14181e;
--card:#1d232b;--good:#4fb36a;--bad:#e36060;--look:#e0973a;--note:#6fa8e8}}
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:76rem;padding:0 1rem;color:var(--text);
background:var(--back)}
h1{margin:0 0 .2rem}h2{margin:2.2rem 0 .6rem;padding-bottom:.2rem;border-bottom:1px solid var(--line)}
h3{margin:1rem 0 .3rem}.facts,.dim{color:var(--dim)}
.badge{display:inline-block;padding:.1rem .7rem;border-radius:1rem;color:#fff;font-weight:600;
margin:0 .4rem .3rem 0}.badge.good{background:#23803a}.badge.bad{background:#b51d1d}
.badge.look{background:#b26200}.badge.none{background:#7a8594}
table{border-collapse:collapse}th,td{text-align:left;vertical-align:top;padding:.3rem .7rem .3rem 0;
border-bottom:1px solid var(--line)}th{color:var(--dim);font-weight:600}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
code{font-size:.9em;background:var(--card);padding:.05rem .3rem;overflow-wrap:anywhere}
figure{margin:.4rem .8rem .4rem 0;display:inline-block}
figure img{max-width:100%;height:auto;border:1px solid var(--line);border-radius:.4rem;display:block}
figcaption{color:var(--dim);font-size:.9em}
"""


def page(title: str, body: Iterable[str], style: str = "") -> str:
    """A whole page that needs nothing from elsewhere.

    Args:
        title: plain text.
        body: HTML.
        style: CSS beside `STYLE`.
    """
    head = (
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<style>{STYLE}{style}</style></head><body>"
    )
    return "\n".join(["<!doctype html>", head, *body, "</body></html>"]) + "\n"


def figure(png: bytes, caption: str, width: int | None = None, *, shown: bool = True) -> str:
    """A picture in the page; `caption` is plain text, below it where `shown`."""
    data = base64.b64encode(png).decode("ascii")
    text = escape(caption)
    sized = "" if width is None else f' width="{width}"'
    below = f"<figcaption>{text}</figcaption>" if shown else ""
    return f'<figure><img{sized} alt="{text}" src="data:image/png;base64,{data}">{below}</figure>'


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of plain text."""
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def badge(text: str, kind: str) -> str:
    """A coloured label; `kind` is good, bad, look or none."""
    return f'<span class="badge {kind}">{escape(text)}</span>'


def plural(count: int, word: str) -> str:
    """`1 link`, `2 links`."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
