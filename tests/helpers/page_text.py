"""The text of a page, as somebody reads it."""

import html
import re


def page_text(page: str) -> str:
    """Without its tags and its styles, and with single spaces."""
    return " ".join(html.unescape(re.sub(r"<style.*?</style>|<[^>]+>", " ", page, flags=re.DOTALL)).split())
