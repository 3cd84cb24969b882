"""Courses of laboratory notebooks on any plant: answers, checks at home, explorers, reports; and grading of a class."""

__version__ = "0.2.0"
