"""Levels of outcomes from marks: per student and criterion, per class; and the scoring sheets."""
