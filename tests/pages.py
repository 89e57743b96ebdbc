"""Reading a page back, and what makes it one that opens anywhere."""

import base64
from html.parser import HTMLParser
from pathlib import Path

NETWORK = ("fetch(", "XMLHttpRequest", "WebSocket", "import(", "http:", "https:")
VOID = {"meta", "img", "br", "hr", "link", "input"}  # elements without an end
REFERENCES = {"src", "href", "srcset", "data", "action", "poster", "background"}
PNG = b"\x89PNG\r\n\x1a\n"


class Page(HTMLParser):
    """A page's text, the cells of its tables, the figures in it and what it refers to."""

    def __init__(self, path: Path):
        super().__init__()
        self.source = path.read_text(encoding="utf-8")
        self.open, self.tags, self.references, self.figures = [], [], [], []
        self.text, self.cells, self.scripts = "", [], []
        self.feed(self.source)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            assert not name.startswith("on"), f"{name} runs a script"
            if name in REFERENCES:
                self.references.append(value)
        if tag in ("td", "th"):
            self.cells.append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.text += data
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.cells[-1] += data


def checked_page(path: Path) -> Page:
    """The page at a path, found whole and self-contained, its figures decoded."""
    page = Page(path)
    assert page.source.startswith("<!DOCTYPE html>") and not page.open
    assert "link" not in page.tags and "iframe" not in page.tags
    assert "url(" not in page.source and "@import" not in page.source
    for script in page.scripts:
        assert not any(word in script for word in NETWORK)
    kind = "data:image/png;base64,"
    for reference in page.references:
        assert reference.startswith(kind), f"refers to {reference[:60]}"
        picture = base64.b64decode(reference.removeprefix(kind), validate=True)
        assert picture.startswith(PNG)
        page.figures.append(picture)
    assert page.tags.count("img") == len(page.figures) == len(page.references)
    return page
