"""The instructor's day: a class at a glance, in the terminal and on a page.

=================  =================================================================================================
``section``        what is told, in the form that both ways of showing it take
``counted``        what counts: what ``course.toml`` drops is left out before anything is told
``students``       who handed in what; who is in trouble, and why
``waiting``        what waits for whom; faults of the key
``slips``          which questions went wrong for many, and the commonest reasons
``times``          how long grading and scoring took, and what is left
``published``      feedback that was given back, what changed since, and what is not ready
``glance``         all of it, from a gradebook
``shown``          as text, and as a page
=================  =================================================================================================

Only what the gradebook holds is told; what it does not know is said to be unknown.
"""
