"""A folder that somebody else filled: modules named as those that our programs import."""

#: Of Python itself, of what JupyterLab and its kernels need, and of what commands and marking need.
OF_OTHERS = (
    *("json", "pathlib", "random", "typing", "multiprocessing"),
    *("jupyterlab", "tornado", "traitlets", "zmq", "ipykernel_launcher", "ipykernel", "IPython"),
    *("typer", "sqlalchemy"),
)
#: What cells import themselves: then a student's own module comes first.
OF_CELLS = ("numpy", "rotflex", "jedi")


def lay(*folders, names=(*OF_OTHERS, *OF_CELLS)):
    """Put modules into folders, and return a function that lists those that were imported."""
    for folder in folders:
        folder.mkdir(exist_ok=True)
        for name in names:
            mark = folder / f"{name}.ran"
            (folder / f"{name}.py").write_text(f"open({str(mark)!r}, 'w').close()\nraise ImportError('a stranger')\n")
    return lambda: [str(path) for folder in folders for path in folder.glob("*.ran")]
