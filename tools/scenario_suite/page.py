# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""One HTML page without anything outside it: style, tables, pictures."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from PIL import Image

STYLE = """
:root { color-scheme: light dark; --ink: #1c1c1e; --paper: #fdfdfc; --soft: #6a6a70;
  --line: #d9d9d6; --head: #f1f1ee; --good: #1f7a4d; --bad: #b3261e; --near: #8a5a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e6e3; --paper: #18181a; --soft: #9c9ca3;
  --line: #3a3a3e; --head: #232326; --good: #57c08c; --bad: #ff8a80; --near: #e3b341; } }
@media print { :root { --ink: #000; --paper: #fff; --soft: #444; --line: #bbb; --head: #eee;
  --good: #1f7a4d; --bad: #b3261e; --near: #8a5a00; }
  body { font-size: 9.5pt; max-width: none; padding: 0; } h2 { break-after: avoid; }
  figure, tr { break-inside: avoid; } details { display: none; } }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 1240px; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.6rem; margin: 0 0 .3rem; } h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem;
  border-bottom: 1px solid var(--line); padding-bottom: .2rem; } h3 { font-size: 1rem; }
p, li { max-width: 78ch; } .soft { color: var(--soft); font-size: .88rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .83rem; margin: .6rem 0; width: 100%; }
th, td { padding: .28rem .45rem; text-align: right; border-bottom: 1px solid var(--line);
  white-space: nowrap; font-variant-numeric: tabular-nums; }
th { background: var(--head); font-weight: 600; vertical-align: bottom; }
th, td span { white-space: normal; }
td:first-child, th:first-child { text-align: left; white-space: normal; min-width: 13.5rem; }
td.text, th.text { text-align: left; white-space: normal; min-width: 13rem; }
tr.group td { font-weight: 600; padding-top: .8rem; border-bottom: none; }
.good { color: var(--good); font-weight: 600; } .bad { color: var(--bad); font-weight: 600; }
.near { color: var(--near); font-weight: 600; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 1rem; }
figure { margin: .8rem 0; } figure svg { width: 100%; height: auto; max-height: 430px;
  font-family: inherit; } figure img { max-width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: .85rem; }
pre { font: .76rem/1.45 ui-monospace, monospace; white-space: pre-wrap; overflow-wrap: anywhere;
  background: var(--head); padding: .6rem .8rem; border-radius: 4px; margin: .4rem 0; }
details { margin: .3rem 0; } summary { cursor: pointer; }
a { color: inherit; text-decoration-color: var(--soft); }
nav a { margin-right: 1rem; }
"""


class Html(str):
    """Text that is HTML already."""


def text(value: str) -> Html:
    return value if isinstance(value, Html) else Html(escape(value))


def element(tag: str, content: str, css: str = "", anchor: str = "") -> Html:
    css = f' class="{css}"' if css else ""
    anchor = f' id="{escape(anchor)}"' if anchor else ""
    return Html(f"<{tag}{css}{anchor}>{text(content)}</{tag}>")


def paragraph(content: str, css: str = "") -> Html:
    return element("p", content, css)


def link(anchor: str, content: str) -> Html:
    return Html(f'<a href="#{escape(anchor)}">{text(content)}</a>')


def items(lines: Iterable[str]) -> Html:
    return Html("<ul>" + "".join(element("li", line) for line in lines) + "</ul>")


class Table:
    """Rows of cells; columns in `texts` are left-aligned."""

    def __init__(self, header: Sequence[str], texts: Sequence[int] = ()) -> None:
        self.texts = set(texts)
        self.width = len(header)
        self.lines = [self.line("th", header)]

    def line(self, tag: str, cells: Sequence[str]) -> str:
        out = "".join(
            element(tag, cell, "text" if i in self.texts else "") for i, cell in enumerate(cells)
        )
        return f"<tr>{out}</tr>"

    def add(self, *cells: str) -> None:
        self.lines.append(self.line("td", cells))

    def group(self, title: str) -> None:
        self.lines.append(f'<tr class="group"><td colspan="{self.width}">{text(title)}</td></tr>')

    def html(self) -> Html:
        return Html('<div class="scroll"><table>' + "".join(self.lines) + "</table></div>")


def drawing(content: str, caption: str) -> Html:
    """A plot (SVG) or picture with words below."""
    return Html(f"<figure>{content}<figcaption>{text(caption)}</figcaption></figure>")


def picture(path: Path, width_px: int = 900) -> Html:
    """An image file as part of the page."""
    with Image.open(path) as opened:
        image = opened.convert("RGB")
    if image.width > width_px:
        image = image.resize((width_px, round(image.height * width_px / image.width)))
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=82)
    data = base64.b64encode(buffer.getvalue()).decode()
    return Html(f'<img alt="{escape(path.stem)}" src="data:image/jpeg;base64,{data}">')


def side_by_side(parts: Iterable[str]) -> Html:
    return Html('<div class="pair">' + "".join(parts) + "</div>")


def folded(title: str, content: str, anchor: str = "") -> Html:
    identity = f' id="{escape(anchor)}"' if anchor else ""
    return Html(f"<details{identity}><summary>{text(title)}</summary>{text(content)}</details>")


def page(title: str, parts: Iterable[str]) -> str:
    body = "\n".join(text(part) for part in parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n"
        "</body>\n</html>\n"
    )
