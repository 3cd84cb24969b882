"""papermill's engine ``labcourse``, as the entry point names it.

papermill imports each engine that is installed, and would itself fail with one that raises. So nothing else is imported
here before a notebook is run.
"""

from __future__ import annotations

from typing import Any


class Engine:
    """What papermill asks of an engine. (:mod:`labcourse.run.warm` does the work.)"""

    @staticmethod
    def execute_notebook(nb: Any, kernel_name: str, **options: Any) -> Any:
        """Run a notebook, and return it with its outputs (:func:`labcourse.run.warm.execute_notebook`).

        Raises
        ------
        ValueError
            If it is not in Python.
        """
        if "python" not in (language := Engine.nb_language(nb)).lower():
            raise ValueError(f"The engine labcourse runs notebooks in Python, and this one is in {language}.")
        from labcourse.run import warm

        return warm.execute_notebook(nb, **options)

    @staticmethod
    def nb_kernel_name(nb: Any, name: str | None = None) -> str:
        """Return the name of the kernel; any will do, because this Python runs the cells."""
        return str(name or nb.metadata.get("kernelspec", {}).get("name") or "python3")

    @staticmethod
    def nb_language(nb: Any, language: str | None = None) -> str:
        """Return the language of a notebook: Python, if it names none."""
        named = nb.metadata.get("language_info", {}).get("name")
        return str(language or named or nb.metadata.get("kernelspec", {}).get("language") or "python")
