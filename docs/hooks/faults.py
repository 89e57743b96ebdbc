"""A line `@faults` is replaced by what stops a run: each fault's message, and what to do."""

import re

from jaxsph.integrate import FaultCode, explanation

_DIRECTIVE = re.compile(r"^@faults$", re.MULTILINE)


def faults() -> str:
    """A list of all messages."""
    told = (explanation(code).partition("; ") for code in FaultCode if code != FaultCode.NONE)
    return "\n".join(f"- *{meaning}*: {remedy}." for meaning, _, remedy in told)


def on_page_markdown(markdown, page, config, files):
    return _DIRECTIVE.sub(lambda found: faults(), markdown)
