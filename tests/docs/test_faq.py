"""The page of questions speaks of messages that there are."""

import ast
import re

from tests.docs.test_pages import ROOT

PAGE = (ROOT / "docs" / "faq.md").read_text()
QUOTED = re.findall(r"^### `(.+)`$", PAGE, re.MULTILINE)


def test_what_it_quotes_is_said_by_the_code():
    files = (path for top in ("jaxsph", "jaxsph_rom") for path in (ROOT / top).rglob("*.py"))
    nodes = (node for path in files for node in ast.walk(ast.parse(path.read_text())))
    said = "\n".join(n.value for n in nodes if isinstance(n, ast.Constant) and type(n.value) is str)
    assert len(QUOTED) >= 12
    assert not [text for text in QUOTED if text not in said]


def test_it_knows_every_likely_cause():
    source = (ROOT / "jaxsph" / "likely_cause.py").read_text()
    causes = set(re.findall(r'"(likely [a-z ]+:)', source))
    assert len(causes) == 6 and causes <= set(QUOTED)
