"""Erase a person, or copy what is stored about them.

===========  ==========================================================================================
``others``   take the person out of other students' runs and files
``results``  the folder of results: delete the person's folders, write the files of the class anew
``remains``  where the person is still named: files, submissions, settings
``copied``   all that is stored about a person, as a zip for them
===========  ==========================================================================================

What is deleted from the gradebook is in :mod:`labcourse.grading.gradebook.persons`.
"""
