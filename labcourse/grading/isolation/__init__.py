"""Run an untrusted command isolated, within limits, and get one file back.

A general package: it knows nothing of courses or marks, and depends on :mod:`labcourse.errors` alone.

sandbox      ``run``: a command in a sandbox (bubblewrap on Linux), or an error; never the command without it
unisolated   the same call without isolation, for those who trust the code
layers       the isolation layers of this computer, there or missing, and what to do
selftest     attacks, really made from inside, and whether they were contained

outcome      the limits, and what comes back
bubblewrap   the arguments of bubblewrap
seccomp      the filter of system calls
cgroups      memory and processes of all together, where the system lets us limit them
pipes        feed and read a running command, never waiting for it
remedies     what to do when a layer cannot be set up
attacks      the program that the self-test runs inside

Everything here can be imported on any system; what is Linux's own is used only when something is run.
"""
