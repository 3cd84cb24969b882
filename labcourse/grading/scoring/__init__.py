"""Scoring of what a person must read: the page in the browser. Instructor only.

=============  =======================================================================================================
``rubric``     what to look for in each part, and what each level is like
``desk``       who gets which answers next, what they give, what they take back, and how far it is
``cards``      what a scorer sees of an answer
``guards``     where browsers find the page, who is let in, and what is said to a browser
``server``     its pages and acts; ``page/`` has their templates, script and style
``start``      the addresses that scorers open, and the program that listens
=============  =======================================================================================================
"""
