"""Submissions taken in and run, in isolation; bytes of ``answers.json`` come back."""
