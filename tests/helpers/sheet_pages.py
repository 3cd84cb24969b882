"""What stands on a page of scoring sheets, read from its HTML."""

import html
import re

Cells = dict[tuple[str, str, str, str], tuple[str, list[str]]]


def cells(page: str) -> Cells:
    """Student, title of the sheet, number of the row ("Total" for the last), and code → level, and points."""
    found: Cells = {}
    for section in page.split("<section")[1:]:
        (title,) = re.findall(r"<h1>(.*?)</h1>", section)
        (student,) = re.findall(r"ID: <strong>(.*?)</strong>", section)
        _first, *codes = re.findall(r'<th scope="col">(.*?)</th>', section)
        for heading, row in re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', section, re.DOTALL):
            for code, cell in zip(codes, re.findall(r"<td>(.*?)</td>", row), strict=True):
                if cell:
                    level, *points = re.findall(r"<(?:strong|span)>(.*?)</", cell)
                    place = (html.unescape(student), html.unescape(title), heading.split()[0], code)
                    assert place not in found
                    found[place] = level, points
    return found
