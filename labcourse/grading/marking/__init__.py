"""Answers judged by a key."""
