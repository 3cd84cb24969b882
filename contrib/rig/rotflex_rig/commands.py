"""The command ``rotflex-rig``: set up a rig, hand out tokens, serve, work, compare."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from rotflex.bench_commands import errors_as_messages
from rotflex_rig import address
from rotflex_rig.queue import LABORATORY, NEW, SETTINGS_FILE, STUDENT, WORKER, Queue, Refused
from rotflex_rig.request import recording_of_bytes
from rotflex_rig.web import checked

app = typer.Typer(no_args_is_help=True, add_completion=False, help="One bench for a whole class.")
Rig = Annotated[Path, Argument(metavar="RIG", help="The rig's folder.")]
_COMPRESSED = 15  # kind of an element in a .mat file, version 5
_MOST_INFLATED = 20_000_000  # bytes of one array in a file


def command(act: Callable[..., None]) -> Callable[..., None]:
    """Add a command. Its errors are said as those of ``rotflex bench``: exit code 2, or 4 with the motor not at 0 V."""
    return app.command()(errors_as_messages()(act))


@contextmanager
def _of_course() -> Iterator[None]:
    """Let what the course's package refuses be said in the same way."""
    from labcourse.errors import CourseError

    try:
        yield
    except CourseError as error:
        raise Refused(500, str(error)) from None


@command
def new(rig: Rig) -> None:
    """Make the folder of a rig, and print the tokens of its worker and of the laboratory's page."""
    rig.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not (settings := rig / SETTINGS_FILE).exists():
        settings.write_text(NEW, encoding="utf-8")
    queue = Queue(rig)
    typer.echo(f"Settings of the rig: {settings}. Its tokens, each shown only this once:")
    for role in (WORKER, LABORATORY):
        token = queue.admit(role, role).get(role)
        typer.echo(f"{role}: {token or f'has one already; a new one comes after rotflex-rig revoke {rig} {role}'}")


@command
def admit(
    rig: Rig, roster: Annotated[Path, Argument(help="The class's roster, a CSV as the gradebook takes it.")]
) -> None:
    """Write tokens.csv, with a token for each student who has none yet. Hand each student their own line."""
    from labcourse.grading.gradebook.roster import read

    queue, tokens = Queue(rig), rig / "tokens.csv"
    if tokens.exists():
        raise Refused(409, f"{tokens} is there from the last time: hand it out, delete it, and come again.")
    with _of_course():
        listed, problems, _columns = read(roster)
    students = [one.student for one in listed.values() if one.student]
    tokens.touch(0o600)  # before tokens are made, which nobody could read if it cannot be
    made = queue.admit(STUDENT, *students)
    tokens.write_text("".join(f"{row}\n" for row in ("student,token", *map(",".join, made.items()))), encoding="utf-8")
    typer.echo("\n".join([*problems, f"{tokens}: {len(made)} new tokens, of {len(students)} students."]))


@command
def revoke(rig: Rig, who: Annotated[str, Argument(help="The student's ID; or worker, or laboratory.")]) -> None:
    """End somebody's token, and take their runs out of the queue."""
    if not Queue(rig).revoke(who):
        raise Refused(404, f"Nobody of the ID {who} has a token.")
    typer.echo(f"{who}'s token has ended.")


@command
def serve(
    rig: Rig,
    url: Annotated[str | None, Option(help="The rig's address for other computers: https://rig.school.edu.")] = None,
    proxy: Annotated[str | None, Option(help="IP address of the proxy that encrypts.")] = None,
    certificate: Annotated[Path | None, Option(help="Certificate (PEM), if no proxy encrypts.")] = None,
    private_key: Annotated[Path | None, Option(help="Its private key, if that is in another file.")] = None,
    port: Annotated[int, Option(min=0, max=65535, help="Where to listen; 0 for a free port.")] = 8700,
) -> None:
    """Serve the rig: for this computer alone, or with --url for others."""
    from labcourse.grading.scoring import start
    from rotflex_rig.server import application

    queue = Queue(rig)
    with _of_course():
        site = start.find_site(url, proxy, certificate, private_key, only_address=False)
        if certificate is not None:
            start.check_certificate(certificate, private_key)
        with start.listening(port, certificate is not None) as listener:
            site = site or start.on_loopback(listener.getsockname()[1])
            typer.echo(f"The rig is at {site.url}, and its page, too. Ctrl-C ends it; nothing is lost.")
            start.run(application(queue, site), listener, certificate, private_key)


@command
def login(url: Annotated[str, Argument(help="The rig's address.")]) -> None:
    """Ask for a token, try it, and keep it for this user of this computer."""
    address.login(url)


@command
def work(
    url: Annotated[str, Argument(help="The rig's address.")],
    bench: Annotated[str, Argument(help="The bench: bench.toml.")],
    twin: Annotated[str, Argument(help="Its virtual twin: virtual:twin.toml.")],
) -> None:
    """Fetch runs from the server, and make them on the bench, until Ctrl-C."""
    from rotflex_rig.worker import Worker

    Worker(checked(url), bench, twin).work()


@command
def compare(rig: Rig, marks: Annotated[str, Argument(metavar="MARKS", help="The class's gradebook.")]) -> None:
    """List the recordings of a class, and which of them the rig made, and for whom."""
    from labcourse.grading.gradebook import Gradebook

    made: dict[tuple[int, bytes], tuple[int, str]] = {}
    for number, (student, path) in Queue(rig).recorded().items():
        alpha = recording_of_bytes(path.read_bytes()).degrees("alpha")  # as files of students have it
        made[alpha.size, hashlib.sha256(alpha.tobytes()).digest()] = number, student
    if "://" not in marks and not Path(marks).is_file():
        raise Refused(404, f"There is no gradebook {marks}.")
    with _of_course(), Gradebook(marks) as book:
        for student in book.handed_in():
            stored = {one.digest: one.name for one in book.stored(student) if one.name.endswith(".mat")}
            for digest, content in book.contents(student, stored).items():
                found = next((made[key] for key in _ends(content, {size for size, _ in made}) if key in made), None)
                by = "is not the rig's" if found is None else f"is run {found[0]} of the rig, made for {found[1]}"
                typer.echo(f"{student}: {stored[digest]} {by}")


def _ends(content: bytes, sizes: set[int]) -> Iterator[tuple[int, bytes]]:
    """Yield hashes of the last columns in a ``.mat`` file, if they had so many samples. Nothing else of it is read."""
    place = 128  # of the first array, behind the header
    while place + 8 <= len(content):
        kind, length = struct.unpack_from("<II", content, place)
        data, place = content[place + 8 : place + 8 + length], place + 8 + length
        if kind == _COMPRESSED:
            try:
                data = zlib.decompressobj().decompress(data, _MOST_INFLATED)
            except zlib.error:
                continue
        for size in sizes:
            yield size, hashlib.sha256(data[-8 * size :]).digest()


if __name__ == "__main__":
    app()
