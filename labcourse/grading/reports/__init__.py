"""Marks for people: pages, tables, and how a batch is going. Instructor only.

================  ====================================================================================================
``result``        what came out for a student
``grades``        the folder of results: ``grades.csv``, each student's ``marks.json`` and ``feedback.html``
``feedback``      the page that a student gets back
``drawn_figure``  a student's figure, drawn again as SVG
``markdown``      a student's text as harmless HTML
``hints``         what class-mates have in common
``intake_table``  ``intake.csv``: what intake cannot know, for an instructor to decide
``changes``       what another marking changed
``live_report``   how a batch is going, on the screen or as JSON
``templating``    the templates of pages; ``templates/`` has those of this room, and what all pages share
================  ====================================================================================================
"""
