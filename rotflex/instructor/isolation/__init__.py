"""Run a command of a stranger's isolated, within limits, and get one file back.

A general room: it knows nothing of courses or marks, and stands on :mod:`rotflex.errors` alone.

sandbox      ``run``: a command behind walls (bubblewrap on Linux), or an error; never the command without them
bare         the same call without walls, for those who trust the code
layers       what of this computer the walls need, found or not, and what to do
selftest     attacks, really made from inside, and whether they were contained

outcome      the limits, and what comes back
walls        what bubblewrap is told
seccomp      the filter of system calls
cgroups      memory and processes of all together, where the system lets us limit them
watching     feed and read a running command, never waiting for it
remedies     what to do when a wall cannot be put up
attacks      the program that the self-test runs inside

Everything here can be imported on any system; what is Linux's own is used only when something is run.
"""
