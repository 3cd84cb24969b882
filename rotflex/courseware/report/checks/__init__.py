"""What the format of a report is held against, one sort of fault a module. None of them knows a course or a value.

=================  ===================================================================================================
``faults``         what a fault is
``prose``          a text of the student's, taken apart: running text, formulas, pictures
``languages``      in which language a text is, and the words by which some faults are told, for each language
``structure``      what is missing: names, texts, figures, rows; how long texts are
``labels``         axes, curves, captions
``mentions``       figures, tables, equations and sources: what the texts refer to, and what there is
``wording``        left-over notes, repeated words, sentences that stand there twice, what belongs elsewhere
``formulas``       LaTeX that cannot be set as it was meant
``numbers``        units, digits, and numbers that are not those of a table
=================  ===================================================================================================
"""
