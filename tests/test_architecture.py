"""No two modules import each other, and a public name is defined in one module of its package."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).resolve().parents[1]

#: Packages of which no module may import one that imports it.
WITHOUT_CIRCLES = ("rotflex", "labcourse")
#: Packages of which only the names of classes and types are looked at: their functions are called by module and name.
ONLY_CLASSES = ("labcourse",)
#: Package → the names that several of its modules may define.
MAY_REPEAT = {
    "rotflex": {
        "app",  # of typer, in each module of commands
        "run",  # of a loop, on a bench and simulated; and the command's entry point
        "free_decay",  # an experiment, and the figure of its recording
        "tracking",
        "validation",
        "gain_by_place",  # in continuous time, and sampled
        "state_space",  # in numbers, and in symbols
    },
    "labcourse": set(),
}


def circle_in(package: str) -> list[str]:
    """Return modules of which each imports the next one, and the last one the first; empty if there are none.

    All imports count: those inside functions, and those for type checking only.
    """
    graph = grimp.build_graph(package, exclude_type_checking_imports=False, cache_dir=None)
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    try:
        TopologicalSorter(imported).prepare()
    except CycleError as error:
        return error.args[1][::-1]  # it lists whoever is imported before whoever imports it
    return []


def _defined(body: list[ast.stmt]) -> Iterator[str]:
    """Find the names that statements define, also under a condition; what they import is defined elsewhere."""
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = (name for target in targets for name in ast.walk(target) if isinstance(name, ast.Name))
            yield from (name.id for name in names if isinstance(name.ctx, ast.Store))
        elif isinstance(node, ast.If | ast.Try):
            yield from _defined([*node.body, *node.orelse])


def repeated_names(folder: Path, only_classes: bool = False) -> dict[str, list[str]]:
    """Return public names that several modules of a package define, each with these modules.

    Names of classes and types begin with a capital and have small letters; with ``only_classes`` others may repeat.
    """
    modules = defaultdict(list)
    for path in sorted(folder.rglob("*.py")):
        for name in set(_defined(ast.parse(path.read_text(encoding="utf-8")).body)):
            if not name.startswith("_") and (not only_classes or (name[0].isupper() and not name.isupper())):
                modules[name].append(path.relative_to(folder).as_posix())
    return {name: paths for name, paths in modules.items() if len(paths) > 1}


@pytest.mark.parametrize("package", WITHOUT_CIRCLES)
def test_no_modules_import_each_other(package):
    circle = circle_in(package)
    assert not circle, " imports ".join(circle)


@pytest.mark.parametrize("package", MAY_REPEAT)
def test_a_public_name_is_defined_in_one_module(package):
    repeated = repeated_names(ROOT / package, package in ONLY_CLASSES)
    assert repeated.keys() == MAY_REPEAT[package], repeated


@pytest.fixture
def made_package(tmp_path, monkeypatch):
    """A package with a circle of three and a name that two modules define."""
    folder = tmp_path / "made_package"
    (folder / "room").mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    (folder / "room" / "__init__.py").write_text("")
    (folder / "first.py").write_text("from made_package.second import Place\n\n\ndef find(): ...\n")
    (folder / "second.py").write_text("class Place:\n    def go(self):\n        from made_package.room import third\n")
    under_type_checking = "if TYPE_CHECKING:\n    from made_package import first\nelse:\n    find = 1\n"
    (folder / "room" / "third.py").write_text(f"from typing import TYPE_CHECKING\n\n{under_type_checking}")
    monkeypatch.syspath_prepend(tmp_path)
    return folder


def test_a_circle_is_found_wherever_its_imports_stand(made_package):
    circle = circle_in("made_package")
    assert circle[0] == circle[-1] and len(circle) == 4
    following = {("first", "second"), ("second", "room.third"), ("room.third", "first")}
    assert set(pairwise(name.removeprefix("made_package.") for name in circle)) == following


def test_a_name_in_two_modules_is_found_and_what_is_only_imported_is_not(made_package):
    assert repeated_names(made_package) == {"find": ["first.py", "room/third.py"]}


def test_of_classes_only_a_repeated_function_or_constant_is_not_found(made_package):
    (made_package / "fourth.py").write_text("Place = tuple[str, int]\nMOST = 3\n")
    (made_package / "fifth.py").write_text("MOST = 4\n")
    assert repeated_names(made_package, only_classes=True) == {"Place": ["fourth.py", "second.py"]}
