"""docs/guide says what holds: what it names is there, and what it counts is counted."""

from __future__ import annotations

import importlib
import inspect
import itertools
import json
import re
import shlex
import tomllib

import pytest
import typer
from checkout import ROOT
from guide_pages import (
    GUIDE,
    PAGES,
    anchor,
    commands,
    fences,
    headings,
    languages,
    links,
    rows,
    spans,
    text,
    without_fences,
)

from rotflex import cli, experiments, lab
from rotflex.config import AMPLIFIERS, CABLE_GAINS, DAC_LIMIT, ENCODERS, srv02
from rotflex.courseware import starts
from rotflex.hil import bench_file, kinds, real, student_benches
from rotflex.instructor import design, model, settings
from rotflex.instructor.course_check import times
from rotflex.instructor.outcomes import sheet_layout
from rotflex.instructor.verdicts import Status
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, OMEGA_N, P_3, P_4, SAMPLE_TIME, ZETA
from rotflex.units import DEG
from rotflex.workbook.predictions import PREDICTIONS
from rotflex.workbook.questions import CATALOGUE
from solutions import tolerances

NAMES = [page.name for page in PAGES]
NOTEBOOKS = {name[:2]: name for name in CATALOGUE.notebooks}
COMMANDS = typer.main.get_command(cli.app).commands


@pytest.mark.parametrize("name", NAMES)
def test_each_link_leads_to_a_file_and_a_heading(name):
    for link in links(name):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, place = link.partition("#")
        target = (GUIDE / path).resolve() if path else GUIDE / name
        assert target.exists(), link
        if place:
            assert place in {anchor(words) for _, words in headings(target)}, link


def test_each_page_is_on_the_first_one():
    assert {link for link in links("index.md") if "/" not in link} == {*NAMES} - {"index.md"}


@pytest.mark.parametrize("name", NAMES)
def test_headings_go_down_step_by_step_and_blocks_say_their_language(name):
    levels = [level for level, _ in headings(name)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    assert all(languages(name))


def command_and_words(line: str) -> tuple[object, list[str]]:
    name, *words = shlex.split(line)[1:]
    found = COMMANDS[name]
    while hasattr(found, "commands"):
        found, words = found.commands[words[0]], words[1:]
    return found, words


@pytest.mark.parametrize("name", NAMES)
def test_each_command_in_a_block_is_taken_as_it_stands(name):
    for line in commands(name):
        found, words = command_and_words(line)
        found.make_context(found.name, words, resilient_parsing=False).close()


@pytest.mark.parametrize("name", NAMES)
def test_options_that_stand_alone_are_those_of_a_command(name):
    there = {
        opt
        for found in (*COMMANDS.values(), *COMMANDS["bench"].commands.values())
        for p in found.params
        for opt in p.opts
    }
    named = {span.split()[0] for span in spans(name) if span.startswith("--")}
    assert named <= there | {"--help"}


@pytest.mark.parametrize("name", NAMES)
def test_each_file_and_folder_of_the_checkout_is_there(name):
    kept = re.compile(r"(solutions|rotflex|docs|data|tools|notebooks|tests|distributions)/[^ …<]*|pyproject\.toml")
    for span in spans(name):
        if kept.fullmatch(span):
            assert (ROOT / span).exists(), span
        if re.fullmatch(r"\d\d_\w+", span):
            assert span in CATALOGUE.notebooks or (ROOT / "solutions" / f"{span}.ipynb").exists(), span
        if re.fullmatch(r"\d\d", span):
            assert span in NOTEBOOKS, span


def resolved(dotted: str) -> object:
    """What a dotted name is the name of."""
    words = dotted.split(".")
    for many in range(len(words), 0, -1):
        try:
            found = importlib.import_module(".".join(words[:many]))
        except ModuleNotFoundError:
            continue
        for word in words[many:]:
            found = getattr(found, word)
        return found
    raise LookupError(dotted)


@pytest.mark.parametrize("name", NAMES)
def test_each_function_that_is_named_is_there(name):
    for span in spans(name):
        dotted = re.match(r"(rotflex|experiments|response|identification|lab)\.[\w.]*\w(?=\(|$)", span)
        if dotted is None or span.endswith((".toml", ".py")) or span in TABLE_5:
            continue
        if dotted[1] == "lab":
            assert hasattr(lab.Lab, dotted[0].split(".")[1]) or hasattr(lab, dotted[0].split(".")[1]), span
        else:
            resolved(dotted[0] if dotted[1] == "rotflex" else f"rotflex.{dotted[0]}")


@pytest.mark.parametrize("name", NAMES)
def test_settings_are_understood_and_name_questions_that_there_are(name, tmp_path):
    inline = [f"[marks]\n{span}" for span in spans(name) if re.match(r"(drop|weights) = ", span)]
    inline += [f"[{table}] {rest}".replace("] ", "]\n") for table, rest in _entries(name)]
    for block in (*fences(name, "toml"), *inline):
        if "address" in tomllib.loads(block):
            (tmp_path / "bench.toml").write_text(block, encoding="utf-8")
            bench_file.load(tmp_path / "bench.toml")
        else:
            due = "" if "[late]" not in block or "[[deadline]]" in block else "[[deadline]]\ndue = 2026-11-21\n"
            (tmp_path / "course.toml").write_text(due + block, encoding="utf-8")
            settings.read(tmp_path, ("workbook", "real_bench"), catalogue=CATALOGUE)


def _entries(name: str) -> list[tuple[str, str]]:
    """`[reflect] asks = false` within a sentence."""
    found = [
        re.fullmatch(r"\[(reflect|feedback|late|levels|outcomes|report)\] (\w+ = .+)", span) for span in spans(name)
    ]
    return [(one[1], one[2]) for one in found if one]


TABLE_4 = """Flexible Joint User Manual.pdf, Flexible Joint Workbook (Student).pdf, setup_rotflex.m, config_srv02.m,
config_rotflex.m, ROTFLEX_ABCD_eqns_student.m, calc_conversion_constants.m, d_pole_placement_student.m, s_rotflex.mdl,
q_rotflex_id.mdl, q_rotflex_val.mdl, q_rotflex.mdl"""
TABLE_5 = """Flexible Joint Workbook (Instructor).pdf, rotflex.mws, rotflex.html, ROT_FLEX_ABCD_eqns.m, d_rotflex_Ks.m,
d_rotflex_pp.m, d_pole_placement.m, plot_rotflex_sweep.m, plot_rotflex_val.m, meas_rotflex_specs.m,
meas_step_rsp_specs.m"""
TABLE_6 = """data_rotflex_sweep_theta.mat, data_rotflex_sweep_alpha.mat, data_rotflex_sweep_vmt,
data_rotflex_val_theta.mat, data_rotflex_val_alpha.mat, data_rotflex_fsf_theta.mat, data_rotflex_fsf_alpha.mat,
data_rotflex_fsf_vm.mat, data_rotflex_psf_theta.mat, data_rotflex_psf_alpha.mat, data_rotflex_psf_vm.mat"""
TABLE_1 = {"01": 90, "02": 45, "03": 75, "04": 15, "05": 45, "07": 60, "08": 60, "09": 30, "10": 15}
SECTIONS = """0, 1, 1 Table 1, 2.1.1 to 2.1.4, 2.1.5, 2.1.6, 2.2, 2.3.1, 2.3.2, 2.4, 3.1, 3.2.1 to 3.2.6, 3.3, 3.4.1,
3.4.2, 3.4.3, 3.4.4, 3.5, 4, 4.1, 4.2, 4.3, 4.4, 4.5, 5.1, 5.2, 5.3, 6, 7, 8, 9, Appendix A"""


@pytest.mark.parametrize(
    ("heading", "listed", "many"),
    [("## Table 4", TABLE_4, 12), ("## Table 5", TABLE_5, 11), ("## Table 6", TABLE_6, 11)],
)
def test_each_file_of_the_workbook_has_something_that_stands_for_it(heading, listed, many):
    files = re.split(r",\s+", listed)
    table = rows("files.md", heading)
    assert [row[0].strip("`") for row in table] == files and len(files) == many
    assert all(re.search(r"`[^`]+`|\]\(", row[1]) for row in table)


def test_what_a_release_holds_of_them_is_said_as_it_is():
    for heading in ("## Table 4", "## Table 5"):
        for _, here, students in rows("files.md", heading):
            kept_back = re.search(r"rotflex\.instructor|solutions/|derivation", here)
            assert students in (("no", "in part") if kept_back else ("yes", "–")), here


def test_each_section_of_the_workbook_has_its_place():
    named = " ".join(row[0] for row in rows("workbook_sections.md", "## Sections"))
    for section in re.split(r",\s+", SECTIONS):
        assert all(word in named.replace(",", "").split() for word in section.split()), section


def test_each_answer_of_the_workbook_has_its_solution():
    table = rows("workbook_sections.md", "## Answers")
    assert [row[0] for row in table] == [number for number in CATALOGUE.questions if number != "0.1"]
    for number, notebook, cell, _ in table:
        assert notebook.strip("`") == CATALOGUE.questions[number].notebook
        solved = json.loads((ROOT / "solutions" / f"{notebook.strip('`')}.ipynb").read_text(encoding="utf-8"))["cells"]
        (source,) = ["".join(one["source"]) for one in solved if one["id"] == cell.strip("`")]
        assert "BEGIN SOLUTION" in source


def minutes(number: str) -> int:
    """What a notebook states; check-course holds it against the formula."""
    first = json.loads((ROOT / "solutions" / f"{NOTEBOOKS[number]}.ipynb").read_text(encoding="utf-8"))["cells"][0]
    return int(re.search(r"about (\d+) minutes", "".join(first["source"]))[1])


def points(questions) -> tuple[float, float]:
    """Points of questions, and how many of them a person gives."""
    parts = [part for question in questions for part in question.parts]
    return sum(part.points for part in parts), sum(part.points for part in parts if part.marked == "person")


def test_the_table_of_notebooks_is_counted():
    *table, last = rows("organisation.md", "## The notebooks")
    assert [row[0].strip("`") for row in table] == list(CATALOGUE.notebooks)
    for notebook, section, time, asked, worth, by_person, _ in table:
        there = [question for question in CATALOGUE.marked.values() if question.notebook == notebook.strip("`")]
        numbers = [question.number for question in there if question.number not in CATALOGUE.judged]
        said = asked.replace(" to ", ", ").split(", ")
        assert (said[0], said[-1]) == (numbers[0], numbers[-1])
        assert (float(worth), float(by_person)) == points(there)
        assert int(time) == minutes(notebook.strip("`")[:2])
        assert all(one.section.startswith(tuple(section.split(" and "))) for one in there) or not section
    sums = [sum(float(row[column]) for row in table) for column in (2, 4, 5)]
    assert [float(last[column]) for column in (2, 4, 5)] == sums


def test_what_there_is_to_answer_is_counted():
    told = re.search(r"There are (\d+) questions, (\d+) tables, (\d+) reports", text("organisation.md"))
    there = [len([one for one in CATALOGUE.questions if one != "0.1"]), len(CATALOGUE.tables), len(CATALOGUE.reports)]
    assert [int(number) for number in told.groups()] == there
    assert f"{points(CATALOGUE.marked.values())[0]:g} points in all" in text("marking.md")


def test_the_parts_of_the_course_are_worth_what_is_said():
    section = {
        "pre-lab, modelling": ["2.2"],
        "in-lab, modelling": ["2.3"],
        "pre-lab, control": ["3.3"],
        "in-lab, control": ["3.4"],
    }
    section |= {"Table 2": ["2.4"], "Table 3": ["3.5"], "report, modelling": ["5.1"], "report, control": ["5.2"]}
    table = rows("marking.md", "## Pre-lab, in-lab, report")
    assert {row[0] for row in table} == {*section}
    for what, asked, worth, by_person, _ in table:
        there = [one for one in CATALOGUE.marked.values() if one.section.startswith(section[what][0])]
        assert (float(worth), float(by_person)) == points(there), what
        if asked:
            assert asked.split(" to ") == [there[0].number, there[-1].number]
    read = {row[0]: row[4] for row in table}
    for what, name in (("report, modelling", "Modeling report"), ("report, control", "Control report")):
        assert f"{len(CATALOGUE.reports[name].parts)} texts" in read[what]


def test_the_formula_of_the_times_is_the_one_that_is_used():
    said = re.sub(r"\s+", " ", text("time.md"))
    formula = (
        r"folded at (\d+) a minute, (\d+) min a figure, (\d+) min an answer.*? (\d+) min one in words, (\d+) min a"
    )
    told = re.search(formula, said)
    used = (times.WORDS_A_MINUTE, times.FIGURE, times.ANSWER, times.IN_WORDS, times.FUNCTION)
    assert tuple(int(number) for number in told.groups()) == used


def test_times_beside_the_workbooks_table_1():
    *table, last = rows("time.md", "## How long it takes")
    assert {row[3].strip("`"): int(row[2]) for row in table} == {number: minutes(number) for number in NOTEBOOKS}
    assert {row[3].strip("`"): int(row[1]) for row in table if row[1] != "–"} == TABLE_1
    assert [int(last[1]), int(last[2])] == [sum(TABLE_1.values()), sum(minutes(number) for number in NOTEBOOKS)]


@pytest.mark.parametrize("plan", [words for _, words in headings("time.md") if re.match("Three|Two|Six", words)])
def test_a_plan_adds_up_has_each_notebook_and_fits_its_sessions(plan):
    had: list[str] = []
    for row in rows("time.md", f"## {plan}"):
        for cell, total in itertools.pairwise(row):
            numbers = re.findall(r"`(\d\d)`", cell)
            if numbers and total.isdigit():
                assert int(total) == sum(minutes(number) for number in numbers), row
                had += numbers
            long = re.search(r"\((\d+) min\)", row[0])
            if long and total.isdigit():
                assert int(total) <= int(long[1])
    assert sorted(had) == sorted(NOTEBOOKS)


def test_what_moves_at_a_bench_lasts_as_long_as_is_said():
    def seconds(name):
        return inspect.signature(getattr(experiments, name)).parameters["duration"].default

    told = re.search(
        r"(\d+) s of sweep, (\d+) s of free swing, ([\d.]+) s and (\d+) s of validation, and (\d+) s each",
        text("time.md"),
    )
    lasts = [seconds("sweep"), seconds("free_decay"), *_validation_seconds(), DURATION]
    assert [float(number) for number in told.groups()] == lasts and seconds("tracking") == DURATION
    assert 50 <= sum(lasts) + DURATION <= 65  # about a minute in all
    said = text("experiments.md")
    for number, near in zip(
        lasts,
        ("experiments.sweep`, # s", "free_decay`, # s", '"step"`, # s', "square wave, # s", "tracking`, # s"),
        strict=True,
    ):
        assert near.replace("#", f"{number:g}") in said
    assert f"±{AMPLITUDE / DEG:.0f} deg, {FREQUENCY:g} Hz" in said


def _validation_seconds() -> list[float]:
    """Of the step and of the square wave, as they are where nothing is said."""
    from rotflex import hil

    found = []
    for signal in ("step", "square"):
        with hil.open("virtual:?preset=workbook") as bench:
            A, B = [[0, 0, 1, 0], [0, 0, 0, 1], [0, 600, -30, 0], [0, -900, 30, 0]], [60, -60]
            A, B = [*map(list, A)], [0, 0, *B]
            found.append(float(experiments.validation(bench, A, B, signal=signal, progress=False).time[-1]))
    return found


def test_versions_extras_and_limits_are_those_of_the_packages():
    said = text("requirements.md")
    ours = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    theirs = tomllib.loads((ROOT / "distributions/instructor/pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {ours["requires-python"], theirs["requires-python"]} == {
        f">={re.search('Python ([0-9.]+) or newer', said)[1]}"
    }
    for name, extra in re.findall(r"`(rotflex|rotflex-instructor)\[(\w+)\]`", said):
        assert extra in (ours if name == "rotflex" else theirs)["optional-dependencies"]
    defaults = {option.name: option.default for option in COMMANDS["grade"].params}
    assert f"up to {defaults['memory'] / 1024:g} GB of memory (`--memory`)" in said


def test_boards_and_parts_are_those_that_are_known():
    said = text("requirements.md")
    assert set(re.findall(r"`((?:q|ni_)\w+)`", said)) == {*kinds.BOARDS}
    assert all(name in said for name in AMPLIFIERS)
    assert all(f"{name} ({counts} counts" in said or f"{name} ({counts})" in said for name, counts in ENCODERS.items())
    assert "gain {}, {} or {}".format(*CABLE_GAINS) in said
    assert f"at {1 / SAMPLE_TIME:.0f} Hz" in said


def test_set_up_names_entries_and_limits_that_there_are():
    said = text("experiments.md")
    for table, entry in re.findall(r"`\[(parts|wiring|board|limits)\] (\w+)", said):
        assert entry in bench_file.TABLES[table]
    assert f"at most {real.CAREFUL.voltage:g} V" in said and f"{DAC_LIMIT:g} V unless given" in said
    assert f"limit of `theta`, {real.LIMITS.theta / DEG:.0f} deg" in said
    only = {
        entry: [key for key in ("high", "low") if bench_file.TABLES["parts"][entry].fits(key)] for entry in ("gear",)
    }
    assert only == {"gear": ["high"]} and not bench_file.TABLES["wiring"]["angle"].fits("potentiometer")
    assert not any(bench_file.TABLES["parts"]["load"].fits(load) for load in ("disc", "bar"))


def test_each_status_is_explained():
    assert [row[0].strip("*") for row in rows("marking.md", "## What an answer can be")] == [
        one.value for one in Status
    ]


def test_the_sheets_have_the_rows_and_columns_that_are_said():
    table = {row[1].strip("`"): row for row in rows("marking.md", "## The four scoring sheets")}
    sheets = {one.name: one for one in sheet_layout.read(ROOT / "solutions", CATALOGUE)}
    assert [*table] == [*sheets]
    for name, (_, _, said, columns) in table.items():
        assert int(said.split()[0]) == len(
            [row for row in sheets[name].rows if not set(row.cells) <= {"GS-1", "GS-2"}]
        ), name
        assert tuple(re.split(", |; ", columns)) == sheets[name].columns


def test_codes_and_outcomes_are_those_of_the_course():
    codes = [code for row in rows("marking.md", "## Codes and outcomes") for code in row[0].split(", ")]
    assert sorted(codes) == sorted(CATALOGUE.outcomes)
    there = tomllib.loads((ROOT / "solutions/outcomes.toml").read_text(encoding="utf-8"))
    none = sorted({*there["outcomes"]} - {goes for to in there["codes"].values() for goes in to})
    assert "no evidence of outcomes {}, {}, {} and {}".format(*none) in text("marking.md")
    assert f"groups of fewer than {settings.CourseSettings().outcomes.fewest})" in text("marking.md")


def test_predictions_are_asked_where_is_said():
    told = re.search(r"before the recordings of ([\d., and]+?) \(", text("organisation.md"))[1]
    assert set(re.split(r", | and ", told)) == {*PREDICTIONS}


def test_tolerances_are_those_that_count():
    table = {row[0]: row[1] for row in rows("adapting.md", "## Tolerances")}
    measured = tolerances.MEASURED["t_s"]
    assert [*table.values()] == [
        *(
            f"{100 * value:g} %"
            for value in (
                tolerances.BY_EYE,
                tolerances.NEAR_TRUE,
                tolerances.J_L,
                tolerances.K_S_FROM_OWN,
                tolerances.DESIRED,
                tolerances.CARRIED,
            )
        ),
        f"{100 * measured['rtol']:g} %, or {measured['atol']:g} s",
    ]


def test_what_is_drawn_lies_where_is_said():
    said = re.sub(r"\s+", " ", text("benches.md"))
    slowest, fastest = map(float, re.search(r"frequency, from (\d+) to ([\d.]+) rad/s", said).groups())
    shortest, longest = map(float, re.search(r"output, ([\d.]+) to ([\d.]+) ms", said).groups())
    mass, length = map(float, re.search(r"within (\d+) % of nominal\) and lengths \((\d+) %\)", said).groups())
    drawn = [student_benches.student_bench(seed) for seed in range(300)]
    omega = [(one.parameters.K_s / one.parameters.J_l) ** 0.5 for one in drawn]
    assert slowest <= min(omega) < slowest + 0.5 and fastest - 0.5 < max(omega) <= fastest
    delays = [1e3 * one.timing.delay for one in drawn]
    assert shortest <= min(delays) < shortest + 0.1 and longest - 0.1 < max(delays) <= longest
    usual = drawn[0].joint.__class__(arm_position=1, d_12=0.0)
    for name, most in (("m_1", mass), ("m_2", mass), ("L_1", length), ("L_2", length)):
        off = max(abs(getattr(one.joint, name) / getattr(usual, name) - 1) for one in drawn)
        assert most / 100 - 0.01 < off < most / 100 + 0.005, name
    assert f"by up to {100 * student_benches.RUN_FRICTION:g} %" in said


def test_classes_that_begin_in_the_middle_have_the_notebooks_and_points_that_are_said():
    table = {row[0].strip('`"'): row for row in rows("middle.md", "A course on control")}
    assert [*table] == [start.name for start in CATALOGUE.starts]
    for start in CATALOGUE.starts:
        _, _given, released, worth, which = table[start.name]
        first, begin, last = re.findall(r"`(\d\d)`", released)
        left = [number for number in NOTEBOOKS if NOTEBOOKS[number] not in start.skips]
        assert left == [first, *(number for number in NOTEBOOKS if begin <= number <= last)]
        assert float(worth) == points(starts.narrowed(CATALOGUE, start).marked.values())[0]
        own = [one for one in CATALOGUE.starts if one.name == "stiffness" or one is start]
        assert set(re.findall(r"\d\.\d+", " ".join(table[one.name][1] for one in own))) == {
            one for one, _ in start.gives
        }
        assert (which == "any") == (start.on_own_bench is not None)


def test_what_is_given_by_hand_is_what_the_page_prints(capsys):
    (program,) = fences("middle.md", "python")
    exec(program, {})
    printed = capsys.readouterr().out
    assert (
        f"ada K_s = {student_benches.student_bench(student_benches.student_seed('ada')).parameters.K_s:.3f}" in printed
    )
    workbook = student_benches.PRESETS["workbook"]
    plant = model.state_space(srv02(), workbook.joint, workbook.parameters.K_s)
    K = design.gain_by_place(plant.A, plant.B, design.desired_poles(ZETA, OMEGA_N, P_3, P_4)).ravel()
    said = "K = [{:.2f}, −{:.2f}, {:.4g}, {:.4g}]".format(*map(abs, K))
    assert said in text("middle.md") and f"K_s is {workbook.parameters.K_s:g} N·m/rad" in text("middle.md")
    assert f"desired_poles({ZETA:g}, {OMEGA_N:g}, {P_3:g}, {P_4:g})" in program


def test_the_poles_of_the_task_are_the_ones_of_the_course():
    real_part, imaginary = ZETA * OMEGA_N, OMEGA_N * (1 - ZETA**2) ** 0.5
    said = f"−{real_part:g} ± {imaginary:g}j, −{-P_3:g} and −{-P_4:g} rad/s"
    assert said in without_fences("benches.md")
