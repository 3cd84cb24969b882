"""This course: its questions, tables and reports, and the probes of its functions. Each number once."""
