"""A course in another language: all that is read is said in it, and every mark stays what it is."""

from __future__ import annotations

import contextlib
import io
import json
import re
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pseudo
import pytest
from checkout import ROOT
from made_courses import OURS
from pseudo import BEGIN, LANGUAGE
from typer.testing import CliRunner
from working_through import Pen, design, modeling, prelab

import rotflex.lab
from rotflex import experiments, figures, hil, widgets
from rotflex.cli import app
from rotflex.courseware import messages
from rotflex.courseware.report import composing
from rotflex.errors import AnswerError, BenchError, GradingError, RecordingError
from rotflex.hil.student_benches import student_seed
from rotflex.instructor import settings
from rotflex.instructor.marking.decoding import decode
from rotflex.instructor.marking.digest import marking_digest
from rotflex.instructor.marking.marking import mark
from rotflex.instructor.release import student_course
from rotflex.instructor.reports import feedback
from rotflex.instructor.reports.result import Result
from rotflex.recording import Recording
from rotflex.widgets.sweeps import SweepExplorer
from solutions.true_bench import TrueBench

STUDENT = "ada"
#: What is given in place of what is right: slips that are called by their names, and what follows from them.
MISTAKES = {
    ("2.1", "V"): lambda right: 2 * right,
    ("2.11", "omega_n"): lambda right: right / (2 * np.pi),
    ("2.12", "K_s"): lambda right: 3 * right,
    ("2.14", "B"): lambda right: -np.asarray(right),
    ("3.4", "desired_poles"): lambda right: 2 * np.asarray(right),
    ("3.9", "poles"): lambda right: -np.asarray(right),
}


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    folder = tmp_path_factory.mktemp("locale")
    pseudo.write(folder)
    return folder


@pytest.fixture
def spoken(catalogue, monkeypatch):
    monkeypatch.setenv(messages.SETTING, LANGUAGE)
    with pseudo.folder_of_catalogues(catalogue):
        messages.speak(LANGUAGE)
        yield


# --- marks ------------------------------------------------------------------------------------------------------------


def answered(folder: Path) -> tuple[bytes, str]:
    """The student's answers, as kept, and what was said on the way."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        lab = rotflex.lab.start(STUDENT, folder=folder)
        write = Pen({}, {})
        write.mistakes = dict(MISTAKES)
        write("0.1", "resolution", 2 * np.pi / 4096)
        prelab(write)
        design(write, *modeling(lab, write))
        for number, parts in write.answers.items():
            lab.answer(number, **parts)
    return lab.book.path.read_bytes(), said.getvalue()


def marked(data: bytes):
    seed = student_seed(STUDENT)
    return mark(OURS, decode(data, seed, OURS.catalogue), TrueBench(STUDENT), seed)


def test_answers_and_marks_are_the_same_in_each_language(tmp_path, catalogue, monkeypatch):
    english, told = answered(tmp_path)
    plain, digest = marked(english), marking_digest(OURS)
    (tmp_path / "other").mkdir()
    with pseudo.folder_of_catalogues(catalogue):
        monkeypatch.setenv(messages.SETTING, LANGUAGE)
        other, said = answered(tmp_path / "other")
        again = marked(other)
        assert marking_digest(OURS) == digest
    assert json.loads(other)["answers"] == json.loads(english)["answers"]
    facts = [(one.question, one.part, one.status, one.points, one.out_of) for one in plain]
    assert [(one.question, one.part, one.status, one.points, one.out_of) for one in again] == facts
    assert len({one.status for one in plain}) == 4 and BEGIN not in told
    # All that is said of them is said in the language.
    assert said.count(BEGIN) > 100
    assert [one.reason for one in again if BEGIN not in one.reason] == []
    assert [one.reason for one in plain if BEGIN in one.reason] == []


def test_feedback_is_written_in_the_language(spoken, tmp_path):
    result = Result(STUDENT, tuple(marked(_few(tmp_path))))
    page = feedback.page(result, OURS.catalogue, "A course")
    assert f'<html lang="{LANGUAGE}">' in page
    shown = re.sub(r"<style>.*?</style>|<[^>]*>", "", page, flags=re.DOTALL)
    shown = without_what_was_said(shown)
    names = {*OURS.catalogue.notebooks, *OURS.catalogue.marked, "A course", "stable"}
    names |= {part.name for question in OURS.catalogue.marked.values() for part in question.parts}
    for name in sorted(names, key=len, reverse=True):
        shown = shown.replace(name, "")
    assert unsaid_in([shown]) == []


def _few(folder: Path) -> bytes:
    with contextlib.redirect_stdout(io.StringIO()):
        lab = rotflex.lab.start(STUDENT, folder=folder, quiet=True)
        lab.answer("2.11", omega_n=3.0)
        lab.answer("3.1", stability="stable")
        return lab.book.path.read_bytes()


# --- explorers, figures, commands -------------------------------------------------------------------------------------

#: Where a scene has texts for people.
_TEXTS = {"label", "title", "text", "alt", "words", "xlabel", "ylabel", "legend", "head", "values", "options"}
_WORDS = re.compile(r"(?<![\w.\[])[^\W\d_]{4,}(?![\w.])")
#: What is no word: units, and how parts, designs and experiments are named in code and addresses.
_NO_WORDS = re.compile(
    r"virtual\S*|Table 2|poles|replay\S*|high|seed|draw|none|plant|encoder\S*|arm_position|\bwith\b", re.IGNORECASE
)


def without_what_was_said(text: str) -> str:
    """A text without its messages, those in others first."""
    while (left := re.sub(r"\[¡(?:(?!\[¡).)*?¡\]", "", text, flags=re.DOTALL)) != text:
        text = left
    return text


def texts_in(scene, within: str = ""):
    if isinstance(scene, dict):
        for name, value in scene.items():
            yield from texts_in([text for _value, text in value] if name == "options" else value, name)
    elif isinstance(scene, list | tuple):
        for value in scene:
            yield from texts_in(value, within)
    elif isinstance(scene, str) and within in _TEXTS:
        yield scene


def unsaid_in(texts) -> list[str]:
    """Texts with words that no catalogue gave."""
    left = (_NO_WORDS.sub("", without_what_was_said(text)) for text in texts)
    return [text for text in left if _WORDS.search(text)]


@pytest.fixture
def lab(tmp_path, spoken):
    with contextlib.redirect_stdout(io.StringIO()):
        return rotflex.lab.start(STUDENT, folder=tmp_path, quiet=True)


def test_an_explorer_says_everything_in_the_language(lab, spoken):
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 600.0, -40, 0], [0, -1000.0, 40, 0]])
    B = np.array([[0], [0], [60.0], [-60.0]])
    with hil.open("virtual:?seed=7") as bench:
        decay = experiments.free_decay(bench)
    made = [
        widgets.open_console(lab),
        widgets.results_table(lab, "Table 2"),
        SweepExplorer(lab=lab),
        widgets.explore_poles(A, B),
    ]
    scenes = [one.scene for one in made]
    for beside in ("margins", "lqr"):
        made[3].receive({"kind": "set", "name": "beside", "value": beside})
        scenes.append(made[3].scene)
    made[0].receive({"kind": "press", "name": "save"})
    scenes.append(made[0].scene)
    for scene in scenes:
        assert str(scene).count(BEGIN) > 5
        assert unsaid_in(texts_in(scene)) == []

    assert all(text.startswith(BEGIN) for text in made[0].words.values())
    picture = figures.free_decay(decay)
    assert picture.alt_text.startswith(BEGIN)
    axes = picture.axes[0]
    assert axes.get_xlabel().startswith(BEGIN)


def test_a_picture_of_a_design_says_everything_in_the_language(spoken):
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 600.0, -40, 0], [0, -1000.0, 40, 0]])
    picture = widgets.explore_poles(A, [[0], [0], [60.0], [-60.0]]).picture()
    named = picture.axes[0].get_legend().get_texts()
    assert len(named) == 2 and all(text.get_text().startswith(BEGIN) for text in named)


@pytest.mark.parametrize(("figure", "table"), [("Figure 2.9", "Table 2"), ("[¡Figure 2.9¡]", "[¡Table¡] 2")])
def test_a_report_is_made_in_the_language(lab, spoken, tmp_path, figure, table):
    """What a student writes a caption behind may be as the course has it, or in their language."""
    source = (ROOT / "notebooks" / "04_modeling_results.ipynb").read_text(encoding="utf-8")
    source = source.replace("**Figure 2.9:** ", f"**{figure}:** The arm swings.")
    source = source.replace("**Table 2:** ", f"**{table}:** What came out.")
    (tmp_path / "04_modeling_results.ipynb").write_text(source, encoding="utf-8")
    document = composing.composed(lab, tmp_path, "Modeling report", datetime(2026, 11, 2))
    assert document.title.startswith(BEGIN) and not document.told
    assert all(section.heading.startswith(BEGIN) for section in document.sections)
    first, *others = document.figures
    assert first.caption == "The arm swings." and all(one.caption.startswith(BEGIN) for one in others)
    (results,) = (one for one in document.tables if one.rows)
    assert results.caption == "What came out." and all(row[0].startswith(BEGIN) for row in results.rows)


def test_errors_and_tables_are_said_in_the_language(lab, spoken):
    with pytest.raises(AnswerError, match=re.escape(BEGIN)):
        lab.answer("2.99", x=1)
    with pytest.raises(BenchError, match=re.escape(BEGIN)):
        hil.open("nowhere")
    with pytest.raises(RecordingError, match=re.escape(BEGIN)):
        Recording.load("no.csv")
    assert unsaid_in(map(str, lab.record("2.11", omega_n="twenty"))) == []
    table = re.sub(r"<[^>]*>", " ", lab.table("Table 2")._repr_html_())
    assert table.count(BEGIN) > 15


@pytest.mark.parametrize("command", ["check", "submit", "restore"])
def test_a_students_command_speaks_the_language_of_the_folder(tmp_path, catalogue, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(messages.SETTING, raising=False)
    course = {"student": STUDENT, "language": LANGUAGE}
    for language, begins in ((LANGUAGE, f"rotflex: {BEGIN}"), ("en", "rotflex: ")):
        course = {"student": STUDENT, "language": language}
        (tmp_path / "course.json").write_text(json.dumps(course), encoding="utf-8")
        with pseudo.folder_of_catalogues(catalogue):
            done = CliRunner().invoke(app, [command])
        assert done.exit_code == 2 and done.output.startswith(begins)
        assert (BEGIN in done.output) == (language == LANGUAGE)


def test_a_release_and_a_session_begun_with_it_speak_the_courses_language(tmp_path, catalogue, monkeypatch, capsys):
    """From ``course.toml`` by way of ``course.json``."""
    monkeypatch.delenv(messages.SETTING, raising=False)
    with pseudo.folder_of_catalogues(catalogue):
        (tmp_path / "course.toml").write_text(f'[course]\nlanguage = "{LANGUAGE}"\n', encoding="utf-8")
        decided = settings.read(tmp_path)
        assert decided.language == LANGUAGE and decided.of_marking() != settings.CourseSettings()
        about = student_course._about(replace(OURS, settings=decided), tmp_path)
        (tmp_path / "course.json").write_text(json.dumps(about), encoding="utf-8")
        rotflex.lab.start(STUDENT, folder=tmp_path)
        assert capsys.readouterr().out.count(BEGIN) > 3
        (tmp_path / "course.json").write_text(json.dumps({**about, "language": "qq"}), encoding="utf-8")
        rotflex.lab.start(STUDENT, folder=tmp_path, quiet=True)
        assert "'qq'" in capsys.readouterr().out


def test_what_names_no_language_is_no_setting(tmp_path):
    (tmp_path / "course.toml").write_text('[course]\nlanguage = "German"\n', encoding="utf-8")
    with pytest.raises(GradingError, match=r"course\.language: it is 'German'.*the short name of a language"):
        settings.read(tmp_path)
