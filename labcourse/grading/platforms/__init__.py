"""Marks into the files of other platforms.

=================  ==================================================================================================
``their_file``     a file's bytes ↔ its cells: what is not changed stays as it is, byte for byte
``recognised``     which platform wrote a file, and which of its columns can take marks, out of how many points
``rules``          what each platform's file looks like, and how it says so
``matching``       whose row is whose: by ID, login or e-mail, and nobody is guessed
``earned``         what each student has by the gradebook, or what they still wait for
``filled``         one column with marks in it, and all that there is to tell about that
``feedback_zip``   feedback pages under the names by which a platform takes them back
=================  ==================================================================================================
"""
