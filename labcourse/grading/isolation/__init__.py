"""Run an untrusted command isolated, within limits, and get the files back that it leaves.

A general package: it knows nothing of courses or marks, and depends on :mod:`labcourse.errors` alone.

sandbox      ``run``: a command in a sandbox (bubblewrap on Linux), or an error; never the command without it
unisolated   what ``run`` uses for commands that are trusted
selftest     the isolation layers of this computer, with remedies; and an attack on each of eight, really made

process      the limits on a command, its pipes, and its outcome
bubblewrap   the arguments of bubblewrap, and what to do if it fails
seccomp      the filter of system calls
cgroups      memory and processes of everything together, where the system lets us limit them
attacks      the program that the self-test runs inside a sandbox

All modules can be imported on any system; what only Linux has is used when something is run.
"""
