"""A course's notebooks in another language: their text cells in ``.po`` files, and back.

The files lie in the course's folder, ``locale/LANGUAGE/notebooks/NOTEBOOK.po``, one for each notebook with a student
version. What a translation must not change is compared before it is used; a cell that changes it stays as it is, and
that is told.

==============  ======================================================================================
``paragraphs``  a text cell in paragraphs, list items and rows of tables: what is translated at a time
``unchanged``   what a translation has to have as the source has it: formulas, code, targets, numbers, …
``po_files``    notebook → ``.po``: what was translated before is kept
``translated``  notebook and ``.po`` → notebook in that language, and what is not in it
==============  ======================================================================================
"""
