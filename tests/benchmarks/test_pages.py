"""Tables on the pages are those of the stored results."""

import pytest

from benchmarks.pages import PAGES, TABLES, refreshed


@pytest.mark.parametrize("page", sorted(PAGES.glob("*.md")), ids=lambda page: page.stem)
def test_no_table_is_stale(page):
    text = page.read_text(encoding="utf-8")
    assert refreshed(text) == text, "run `python -m benchmarks.pages`"


def test_each_table_is_on_a_page():
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES.glob("*.md"))
    assert all(f"<!-- table {name} -->" in pages for name in TABLES)


def test_a_changed_number_is_put_right():
    text = "<!-- table still-water -->\n\n| old |\n\n<!-- end -->\nafter\n"
    assert "| old |" not in refreshed(text) and refreshed(text).endswith("<!-- end -->\nafter\n")
