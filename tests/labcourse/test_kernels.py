"""What a kernel of `rotflex lab` says where its set-up cell has not been run."""

import json

import pytest
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import start_new_kernel

from labcourse.jupyter import kernel
from labcourse.server import SafeKernelSpec


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Run code in a kernel in a student's folder; return what it prints."""
    folder = tmp_path_factory.mktemp("course")
    (folder / "course.json").write_text(json.dumps({"student": "ada"}), encoding="utf-8")
    argv = ["python", "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    spec = SafeKernelSpec(argv=argv, language="python", display_name="Python")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(KernelSpecManager, "get_kernel_spec", lambda self, name: spec)
        manager, client = start_new_kernel(cwd=str(folder))

    def run(code):
        texts, errors = [], []

        def hear(message):
            if message["msg_type"] == "stream":
                texts.append(message["content"]["text"])
            if message["msg_type"] == "error":
                errors.append(message["content"]["ename"])

        # What follows an error at once may be aborted without a word otherwise.
        client.execute_interactive(code, output_hook=hear, timeout=60, stop_on_error=False)
        return "".join(texts), errors

    yield run
    client.stop_channels()
    manager.shutdown_kernel(now=True)


@pytest.mark.parametrize(
    "cell", ['lab.answer("2.1", V=1)', "figures.show(None)", "omega_n * 2", "def f():\n    return np\nf()"]
)
def test_after_a_restart_a_missing_name_is_explained_whichever_it_is(printed, cell):
    text, errors = printed(cell)
    assert kernel.WHAT_TO_DO in text and errors == ["NameError"]


def test_other_errors_and_names_are_left_to_python(printed):
    assert printed("1 / 0") == ("", ["ZeroDivisionError"])
    assert printed("lab = 1\nmisspelt") == ("", ["NameError"])
    assert printed(
        "del lab\nprint([name for name in dir() if name in ('NotebookKernel', 'COURSE_FILE', 'rotflex')])"
    ) == (
        "[]\n",
        [],
    )
