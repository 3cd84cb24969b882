"""The command ``rotflex`` that says each problem by its code alone: ``python -m sentences_as_codes grade ...``.

The processes in which it marks import this module, too, and do the same.
"""

import labcourse.sentences
from labcourse.problems import Code

#: In place of all sentences.
AS_CODES = {code: code.value for code in Code}

if __name__ in ("__main__", "__mp_main__"):
    labcourse.sentences._SENTENCES = AS_CODES

if __name__ == "__main__":
    from rotflex.cli import run

    run()
