"""Scoring what a person must read: the page in the browser, and tables for a way without one. Instructor only.

=============  =======================================================================================================
``rubric``     what to look for in each part, and what tells one level from the next
``alike``      answers that are nearly the same, and in what they differ
``desk``       who gets which answers next, what they give, and what they take back
``remarks``    remarks that are used again
``progress``   tallies, what is left and how long it takes
``cards``      what a scorer has before them, ready for a page
``sent``       what a page sends, read or refused
``guards``     who is let in, and what a browser is told
``server``     the page as a server on the loopback interface; ``page/`` has its templates, script and style
``tables``     scores out and in as a table
=============  =======================================================================================================
"""
