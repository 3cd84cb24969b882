"""What is said and set for those who do not install: it is what `rotflex lab` does, and what it names is there."""

from __future__ import annotations

import json
import re

from checkout import ROOT

from labcourse import server


def test_binders_settings_are_among_those_of_rotflex_lab():
    script = (ROOT / "binder" / "postBuild").read_text(encoding="utf-8")
    told = re.findall(r'^c\.(\w+)\.(\S+) = "(.*)"$', script, re.MULTILINE)
    assert len(told) == 2 and all(server.SETTINGS[section][name] == value for section, name, value in told)
    # repo2docker takes a dot alone for the name of a package, and installs before the folder is there.
    assert (ROOT / "binder" / "requirements.txt").read_text(encoding="utf-8") == "./\n"


def test_the_development_container_is_a_stage_of_the_image_and_a_students_image_has_no_solutions():
    container = json.loads((ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    image = (ROOT / container["build"]["dockerfile"].removeprefix("../")).read_text(encoding="utf-8")
    stages = re.split(r"^FROM ", image, flags=re.MULTILINE)[1:]
    names = {stage.split()[2]: stage for stage in stages if " AS " in stage.splitlines()[0]}
    assert container["build"]["target"] in names
    assert stages[-1].split() == ["student"]  # what comes of it where no target is named
    copied = re.findall(r"^COPY .*$", names["base"] + names["student"], re.MULTILINE)
    assert copied == ["COPY --from=built /wheels /wheels"]
    assert [line for line in names["student"].splitlines() if line.startswith("USER")] == ["USER 1000"]
