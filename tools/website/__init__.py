"""The site: from the repository's pages, notebooks and docstrings to a folder that a browser shows without a network.

=============  ========================================================================================================
``staging``    which pages there are, for whom, and where their links lead; all that Sphinx sees is copied there first
``chapters``   the student notebooks, run before anything is answered
``reference``  docstrings as Sphinx takes them
``secrets``    what the solutions say and a student's copy does not: none of it may be in the public site
``built``      the pages as they were built: their links, and how far each is from the front
=============  ========================================================================================================
"""
