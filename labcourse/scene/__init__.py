"""Explorers: a state in Python, a scene of plain data, and the canvas that draws it."""
