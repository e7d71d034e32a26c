"""The whole guide as one HTML page that opens offline."""

from __future__ import annotations

from html import escape

from markdown_it import MarkdownIt

from cablecomp.guide.topics import names, text_of, title_of
from cablecomp.report.page import CSS


def guide_page() -> str:
    """Every topic in reading order, with a list of them on top."""
    markdown = MarkdownIt("commonmark", {"html": True}).enable("table")
    links = "".join(f'<a href="#{name}">{escape(title_of(name))}</a>' for name in names())
    body = "".join(f'<section id="{name}">{markdown.render(text_of(name))}</section>' for name in names())
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>cablecomp: guide</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{CSS}main {{ max-width: 100ch; }} main h1 {{ font-size: 22px; }}"
        " table { display: block; overflow-x: auto; }</style></head>"
        f"<body><header><h1>cablecomp: guide</h1><nav>{links}</nav></header><main>{body}</main></body></html>\n"
    )
