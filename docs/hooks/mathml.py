"""Equations become MathML as the site is built: browsers show it without scripts or fonts."""

import html
import re

from latex2mathml.converter import convert

_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
_BLOCK = re.compile(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', re.DOTALL)


def on_page_content(content, page, config, files):
    def block(found):
        return f'<div class="equation">{convert(html.unescape(found[1]), display="block")}</div>'

    content = _BLOCK.sub(block, content)
    return _INLINE.sub(lambda found: convert(html.unescape(found[1])), content)
