"""Pages parse, hold all they show, and escape what they are told."""

import pytest

from jaxsph.report import page
from tests.pages import PNG, checked_page

NASTY = "<script>alert(\"x\")</script> & 'quoted' </td></table>"


def test_every_piece_is_escaped(tmp_path):
    pieces = [
        page.heading(NASTY),
        page.paragraph(NASTY),
        page.rows({NASTY: NASTY, "number": 3}),
        page.table((NASTY, "b"), [(NASTY, "1"), ("x", NASTY)], (False, True)),
        page.figure(PNG + b"data", NASTY),
    ]
    written = checked_page(page.write_page(tmp_path / "new" / "page.html", NASTY, pieces))
    assert written.figures == [PNG + b"data"]
    assert written.cells == [NASTY, NASTY, "number", "3", NASTY, "b", NASTY, "1", "x", NASTY]
    assert written.text.count(NASTY) == 10  # title twice, 2 texts, 5 cells, 1 caption
    assert written.tags.count("figcaption") == 1


def test_a_table_of_uneven_lines_is_refused():
    with pytest.raises(ValueError, match="shorter|longer"):
        page.table(("a", "b"), [("1",)], (False, False))


def test_it_is_whole_or_not_there(tmp_path):
    def pieces():
        yield page.heading("first")
        raise RuntimeError

    with pytest.raises(RuntimeError):
        page.write_page(tmp_path / "page.html", "t", pieces())
    assert list(tmp_path.iterdir()) == []
