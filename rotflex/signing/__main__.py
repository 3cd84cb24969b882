"""``python -m rotflex.signing``: see the package."""

from rotflex.signing.program import main

if __name__ == "__main__":
    raise SystemExit(main())
