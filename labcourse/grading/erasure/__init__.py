"""A person is erased, or has a copy of what is stored about them.

===========  ==========================================================================================
``others``   what becomes of others' runs and files that name the person
``results``  the folder of results: what is theirs goes, what is of the class is written anew
``remains``  where the person is named still: files, hand-ins that were not taken away, settings
``copied``   all that is stored about a person, as a zip for them
===========  ==========================================================================================

What goes from the gradebook, and what its tables let go of, is in :mod:`labcourse.grading.gradebook.persons`.
"""
