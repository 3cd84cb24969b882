"""What problems say as data: which there are, also those within others, and which names are in them."""

import json

from labcourse.problems import Problem, as_json


def within(reasons):
    """Return problems, and those in their parameters."""
    found = []
    for one in reasons:
        if isinstance(one, Problem):
            found.append(one)
            for value in one.parameters.values():
                found += within(value if isinstance(value, list) else [value])
    return found


def codes(reasons):
    """Return the codes of problems, and what they concern."""
    return [(one.code, one.where) for one in reasons]


def names(reasons):
    """Return all texts in problems, on one line."""
    return json.dumps(as_json([*reasons]), ensure_ascii=False)
