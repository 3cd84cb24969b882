"""Scoring of what a person must read: the page in the browser. Instructor only.

=============  =======================================================================================================
``rubric``     what to look for in each part, and what each level is like
``desk``       who gets which answers next, what they give, and what they take back
``cards``      what a scorer sees of an answer
``progress``   tallies
``guards``     who is let in, and what a browser is told
``server``     the page as a server on the loopback interface; ``page/`` has its templates, script and style
=============  =======================================================================================================
"""
