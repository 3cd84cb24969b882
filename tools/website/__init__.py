"""The site: from the repository's pages, notebooks and docstrings to a folder that a browser shows without a network.

=============  ========================================================================================================
``staging``    which pages are for whom; what Sphinx sees is copied into a folder first
``chapters``   the student notebooks, run before anything is answered
``reference``  docstrings as Sphinx takes them
``secrets``    what the solutions say and a student's copy does not: none of it may be in the public site
=============  ========================================================================================================
"""
