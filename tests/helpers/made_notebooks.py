"""Small notebooks of a course, and what students make of them."""

import copy
import json

LOCKED = {"grade": False, "locked": True, "solution": False, "task": False, "schema_version": 3}
ANSWER = {"grade": True, "locked": False, "solution": True, "task": False, "schema_version": 3, "points": 1}


def text(name, source):
    return {"cell_type": "markdown", "id": name, "metadata": {}, "source": source}


def code(name, source, tags=(), grading=None):
    """A code cell as a notebook's file has it."""
    metadata = {"tags": list(tags)} if tags else {}
    if grading:
        metadata["nbgrader"] = {**grading, "grade_id": name}
    return {
        "cell_type": "code",
        "id": name,
        "metadata": metadata,
        "source": source,
        "outputs": [],
        "execution_count": None,
    }


def locked(name, source, tags=()):
    return code(name, source, tags, LOCKED)


def answer(name, source):
    return code(name, source, (), ANSWER)


def notebook(*cells):
    return {
        "cells": copy.deepcopy(list(cells)),
        "metadata": {"language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def saved(content):
    """A notebook as a file."""
    return json.dumps(content).encode()
