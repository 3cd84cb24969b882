"""The program at a laboratory's bench that signs recordings, in a process of its own.

    python -m rotflex.signing key north.key          # once: makes a key, and prints the public one
    python -m rotflex.signing sign north.toml        # a request on its standard input, a signature on its output

It may run as another user than the student's notebook, by a command such as ``sudo -n -u signer …``, or on another
machine, by ``ssh``: then the key is out of the student's reach. What a student at the bench can forge all the same
stands in ``docs/real_bench_marks.md``.
"""
