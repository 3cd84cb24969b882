"""Marks for people: tables, feedback, the state of a batch."""
