"""The commands of a bench: ``rotflex bench setup | zero | run | watch | fit``.

Modules load when a command needs them.
"""

from __future__ import annotations

import contextlib
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.core

from rotflex.errors import ConfigurationError, IdentificationError, MotorNotStopped, RotflexError, UnknownColumns

if TYPE_CHECKING:
    from rotflex.hil.bench import Bench, Measurement
    from rotflex.recording import Recording


@contextlib.contextmanager
def errors_as_messages() -> Iterator[None]:
    """Show an error of the laboratory or the system as a message, with exit code 2; 4 if the motor was not stopped."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit) as ended:
        _say_notes(ended)
        raise
    except BrokenPipeError:  # who reads our output has gone: typer sees to it
        raise
    except (RotflexError, OSError) as error:
        message = str(error)
        if isinstance(error, OSError) and error.filename:
            message = f"{error.filename}: {error.strerror}."
        # Files hold untrusted text, which must not steer a terminal.
        shown = "".join(char if char.isprintable() or char in "\n\t" else ascii(char)[1:-1] for char in message)
        typer.secho(f"rotflex: {shown}", err=True, fg="red")
        _say_notes(error)
        raise typer.Exit(4 if isinstance(error, MotorNotStopped) else 2) from error


def _say_notes(error: BaseException) -> None:
    """Say what else is known of an error, and of those before it: where the motor stands, and where a recording is."""
    from rotflex.hil.halt import uninterrupted

    with uninterrupted():
        notes: dict[str, None] = {}
        before: BaseException | None = error
        while before is not None:
            notes |= dict.fromkeys(getattr(before, "__notes__", ()))
            before = before.__context__
        for text in notes:
            typer.echo(text, err=True)


class _Commands(typer.core.TyperGroup):
    def invoke(self, ctx: Any) -> Any:
        with errors_as_messages():
            return super().invoke(ctx)


app = typer.Typer(
    cls=_Commands,
    help="Set up a bench, run experiments on it, fit a virtual one to its recordings. "
    "(Does it work? 'rotflex doctor --bench bench.toml' says so.)",
)

_Force = Annotated[bool, typer.Option("--force", help="Write over a file that is there.")]
_Bench = Annotated[str, typer.Option("--bench", help="Its address: bench.toml, or as 'virtual:?seed=7'.")]


class ExperimentName(StrEnum):
    """Name the experiments that can be run."""

    SWEEP = "sweep"
    DECAY = "decay"
    FSF = "fsf"
    PSF = "psf"


@app.command()
def setup(
    board: Annotated[
        str,
        typer.Argument(
            metavar="BOARD", help="Address of a board, as 'quanser:q2_usb/0'; or a bench.toml that is begun already."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="The file that is written: the one that was given, or bench.toml, unless given.")
    ] = None,
    watchdog: Annotated[
        bool, typer.Option("--watchdog", help="Test the watchdog alone, a minute, and add the result to bench.toml.")
    ] = False,
) -> None:
    """Find out, guided step by step, how a bench is wired, and write it down with its commissioning."""
    from rotflex import commissioning, hil
    from rotflex.hil import bench_file

    if board.partition(":")[0] in ("virtual", "replay"):
        raise ConfigurationError(
            f"{board} has no wires and no hands at it: it needs no commissioning. Name a real bench's board."
        )
    is_file = board.endswith(".toml")
    out = out or Path(board if is_file else "bench.toml")
    if is_file and not Path(board).exists():
        raise ConfigurationError(
            f"There is no {board} yet. Name the board, as 'quanser:q2_usb/0', and the file as --out {board}."
        )
    if not is_file and out.exists():
        raise ConfigurationError(f"{out} is there already: give it in place of {board}, or another --out.")
    _check_out(out, force=True)
    file = bench_file.load(board) if is_file else bench_file.BenchFile(board)
    work = commissioning.add_watchdog_test if watchdog else commissioning.commission
    done = work(file, lambda bench, chosen: hil.open(bench.address, setup=chosen), commissioning.Terminal())
    bench_file.save(out, done)
    if watchdog:
        typer.echo(f"The result is in {out}.")
        raise typer.Exit(0 if done.record["watchdog"]["passed"] else 1)
    typer.echo(f"The bench is commissioned. Open it as {out}.")
    typer.echo(
        f"Its name is {bench_file.load(out).name!r} (name = … in the file): where its recordings count for marks, the "
        "course's settings have to name it so."
    )


@app.command()
def zero(
    bench: Annotated[str, typer.Argument(metavar="BENCH", help="Its address, as bench.toml.")] = "bench.toml",
) -> None:
    """Take where the arm stands for its mark, where theta is 0: after power-off, or after it was turned by hand."""
    from rotflex import hil

    with hil.open(bench) as opened:
        if opened.safety.mark is None:
            raise ConfigurationError(f"{bench} has no mark: only a real bench has one. Nothing was changed.")
        done = _ask_for_mark(opened, "Turn the arm to its mark, the amplifier off and no cable twisted.")
    typer.echo("Theta is 0 where the arm stands." if done else "Nothing was changed.")


def _ask_for_mark(bench: Bench, why: str | None, more: str = "") -> bool:
    """Ask whether the arm stands at its mark, and return whether it was taken for it."""
    done = bool(why) and typer.confirm(f"{why}\nDoes the arm stand at its mark{more}?")
    if done:
        bench.set_zero()
    return done


@app.command(hidden=True, context_settings={"ignore_unknown_options": True, "allow_extra_args": True})
def notebook() -> None:
    """Refuse what is gone."""
    raise ConfigurationError(
        "There is no notebook for the commissioning any more: rotflex bench setup guides you through the same steps."
    )


@app.command("run")
def run_experiment(
    experiment: Annotated[ExperimentName, typer.Argument(help="Which.")],
    out: Annotated[Path, typer.Option(help="The .mat file that is written.")],
    bench: _Bench = "bench.toml",
    gain: Annotated[
        str, typer.Option(help="K for fsf and psf: four numbers, as '18.24,-17.15,1.59,0.63', V/rad and V/(rad/s).")
    ] = "",
    duration: Annotated[float | None, typer.Option(help="Seconds; as the course has it unless given.")] = None,
    force: _Force = False,
) -> None:
    """Run an experiment, and save what was recorded, also of a run that ended before its time.

    It fails, with the recording saved, where too many samples came late.
    """
    from rotflex import hil
    from rotflex.recording import saved_ending

    saved_ending(out)
    _check_out(out, force)
    chosen = _experiment(experiment, gain, {} if duration is None else {"duration": duration})
    with hil.open(bench) as opened:
        _ask_for_mark(opened, opened.safety.mark_unknown, ", and is the amplifier on again")
        opened.recorder.path = out
        recording = chosen(opened)
        opened.recorder.save_whole(recording, lambda whole: whole.save(out))
    typer.echo(f"{len(recording)} samples are in {out}.")
    if any(doubt.refuses for doubt in recording.doubts):  # the experiment has said it
        raise typer.Exit(1)


def _check_out(out: Path, force: bool) -> None:
    """Raise ConfigurationError unless a file can, and may, be written there: after the run it is too late."""
    if not out.absolute().parent.is_dir() or out.is_dir():
        raise ConfigurationError(f"{out} cannot be written: name a file in a folder that is there.")
    if out.exists() and not force:
        raise ConfigurationError(f"{out} is there already: name another --out, or add --force.")


def _experiment(experiment: ExperimentName, gain: str, settings: dict[str, Any]) -> Callable[[Bench], Recording]:
    """Return the experiment as a function of an open bench."""
    from rotflex import experiments

    if experiment in (ExperimentName.SWEEP, ExperimentName.DECAY):
        if gain:
            raise ConfigurationError(f"{experiment.value} takes no --gain.")
        return partial(experiments.sweep if experiment is ExperimentName.SWEEP else experiments.free_decay, **settings)
    try:
        K = [float(number) for number in gain.strip("[] ").replace(",", " ").split()]
    except ValueError:
        K = []
    if len(K) != 4:
        raise ConfigurationError(
            f"{experiment.value} needs four numbers as --gain, such as '18.24,-17.15,1.59,0.63'; it is {gain!r}."
        )
    feedback = "full" if experiment is ExperimentName.FSF else "partial"
    return partial(experiments.tracking, controller=K, feedback=feedback, **settings)


@app.command("watch")
def watch_encoders(
    bench: _Bench = "bench.toml",
    duration: Annotated[float, typer.Option(help="Seconds; Ctrl-C ends it before.")] = 60.0,
) -> None:
    """Show both angles at 0 V while the arm is moved by hand."""

    from rotflex import experiments, hil
    from rotflex.units import DEG

    with hil.open(bench) as opened:
        opened.recorder.folder = None
        shown = -1.0

        def show(measured: Measurement, _voltage: float) -> None:
            nonlocal shown
            if measured.time - shown >= 0.1:
                shown = measured.time
                angles = f"theta {measured.theta / DEG:z8.2f} deg   alpha {measured.alpha / DEG:z8.2f} deg"
                typer.echo(f"\r{shown:7.1f} s   {angles} ", nl=False)

        opened.on_sample = show
        with contextlib.suppress(KeyboardInterrupt):  # as the help says
            experiments.watch(opened, duration, progress=False)
    typer.echo("")


def print_checks(bench: str, seconds: float, as_json: bool) -> None:
    """Print a line for each thing that is looked at, and what to do about it, for ``rotflex doctor --bench``."""
    import json
    from dataclasses import asdict

    from rotflex.commissioning import checks
    from rotflex.commissioning.checks import Level

    colours = {Level.OK: "green", Level.WARN: "yellow", Level.FAIL: "red"}
    findings = []
    for finding in checks.examine(bench, seconds):
        findings.append(finding)
        if not as_json:
            typer.secho(finding, fg=colours[finding.level])
    failed = any(finding.level is Level.FAIL for finding in findings)
    if as_json:
        typer.echo(json.dumps({"good": not failed, "findings": [asdict(finding) for finding in findings]}))
    if failed:
        raise typer.Exit(1)


@app.command("fit")
def fit_twin(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="RECORDING", help="Recordings of one bench, .mat or tables of text; three or more say most."
        ),
    ],
    out: Annotated[Path, typer.Option(help="The file that is written.")] = Path("twin.toml"),
    arm_position: Annotated[int, typer.Option(help="Of the top arm, 1, 2 or 3; as recorded unless given.")] = 0,
    encoder: Annotated[str, typer.Option(help="E or EHR; as recorded unless given.")] = "",
    free: Annotated[
        str, typer.Option(help="What to fit, as 'K_s,J_eq,delay'; all that the recordings tell unless given.")
    ] = "",
    J_l: Annotated[
        float | None,
        typer.Option(
            "--J_l",
            help="The link's inertia, kg·m², where your arm was weighed and measured; as the data sheet has it unless "
            "given. Recordings tell sqrt(K_s/J_l) alone: K_s goes with it.",
        ),
    ] = None,
    columns: Annotated[
        str,
        typer.Option(
            help="What the columns of a table are, by number or name, as 't_s=1,theta_deg=pot,vm_V=3'; or all in "
            "order, as 't_s,theta_deg,-,vm_V'. On a terminal it is asked where a file does not say it."
        ),
    ] = "",
    leave_out: Annotated[bool, typer.Option(help="Fit without each recording in turn, too, and predict it.")] = True,
    force: _Force = False,
) -> None:
    """Fit the virtual bench to recordings of a real one, and say how well it tells of one that it has not seen."""
    from dataclasses import replace

    from rotflex import greybox
    from rotflex.config import joint, srv02
    from rotflex.hil.bench_file import Twin, save_twin
    from rotflex.hil.student_benches import VirtualPlantSpec
    from rotflex.hil.virtual import Timing

    _check_out(out, force)
    if out.suffix != ".toml":
        raise ConfigurationError(f"{out}: a fitted bench is a file whose name ends in .toml.")
    every = {str(path): _load(path, columns) for path in recordings}
    if len({path.read_bytes() for path in recordings}) < len(recordings):
        raise ConfigurationError(
            "The same recording is named twice: name recordings of different runs (of a virtual bench, with &run=2)."
        )
    arm = joint(arm_position or _recorded(every, "arm_position", 1))
    servo = srv02(encoder=encoder or _recorded(every, "encoder", "E"))
    names = [name.strip() for name in free.split(",")] if free else None
    initial = greybox.typical(servo, arm)
    if J_l is not None:
        if not 0 < J_l < math.inf or "J_l" in (names or ()):
            raise ConfigurationError(f"--J_l {J_l:g}: give a positive inertia in kg·m², and leave J_l out of --free.")
        initial = replace(initial, J_l=J_l, K_s=initial.K_s * J_l / arm.J_l)  # beginning at the same frequency
    own = ["servo_friction"] if len(every) > 1 and "servo_friction" in (names or greybox.FREE) else []
    for path, recording in every.items():
        _check_fit(path, recording)
    given, titles = list(every.values()), list(every)
    most = greybox.solving.MOST_RUNS * len(given)
    typer.echo(f"Fitting {', '.join(titles)}: {most} runs of the plant at most, and usually a fifth.", err=True)
    fitted = greybox.fit(given, servo, arm, names, initial, per_recording=own)
    typer.echo(fitted.table(titles))
    about: dict[str, Any] = {"recordings": [path.name for path in recordings]}
    about |= {"omega_n": fitted.omega_n.value, "omega_n_u": fitted.omega_n.uncertainty}
    about |= {f"left_{name}_rad": value for name, value in fitted.residual_rms.items()}
    if doubts := fitted.doubts(titles):
        about["doubts"] = doubts
    save_twin(out, Twin(VirtualPlantSpec(arm, fitted.parameters, Timing(delay=fitted.delay)), servo), about)
    typer.echo(f"The fitted bench is in {out}: open it as virtual:{out}.")
    if len(every) == 1:
        typer.echo("There is one recording: how well the fit tells of another, it cannot say.")
    elif leave_out:  # the file is there already: this takes as long again, or longer
        typer.echo(f"Fitting once more without each in turn: {len(every)} fits.", err=True)
        try:
            typer.echo(greybox.leave_one_out(given, servo, arm, names, initial, per_recording=own).table(titles))
        except IdentificationError as error:  # the fit itself is saved already
            typer.echo(f"How well it tells of one that it has not seen, cannot be said: {error}")


def _load(path: Path, columns: str) -> Recording:
    """Load a recording; show the first rows and ask on a terminal, where it does not say what its columns are.

    Raises
    ------
    RecordingError
        If it cannot be read, or nobody can be asked.
    """
    from rotflex.recording import Recording

    try:
        return Recording.load(path, columns=columns)
    except UnknownColumns as error:
        if not sys.stdin.isatty():
            raise
        typer.echo(error)
        asked = []
        for name in ("t", "theta", "alpha", "vm"):
            answer = typer.prompt(f"Column and unit of {name} (- for none)", default=error.guess.get(name, "-"))
            number, _blank, unit = answer.strip().partition(" ")
            asked += [f"{name}_{unit.strip()}={number}"] * (number != "-")
        return Recording.load(path, columns=asked)


def _check_fit(path: str, recording: Recording) -> None:
    """Raise IdentificationError where nothing moves in a recording, or its samples are not evenly spaced."""
    from rotflex.identification import channel

    try:
        recording.sample_time, channel(recording, "theta"), channel(recording, "alpha")
    except RotflexError as error:
        leave_out = " Leave it out." if isinstance(error, IdentificationError) else ""
        raise IdentificationError(f"{path}: {error}{leave_out}") from None


def _recorded(every: Mapping[str, Recording], name: str, default: Any) -> Any:
    """Return what the recordings say of their bench, on which they must agree."""
    from rotflex.unanswered import table_of

    benches = {path: table_of(recording.metadata, "bench") for path, recording in every.items()}
    values = {path: bench[name] for path, bench in benches.items() if name in bench}
    if len(set(values.values())) > 1:
        listed = ", ".join(f"{path}: {value}" for path, value in values.items())
        raise ConfigurationError(
            f"The recordings are of benches that differ in {name} ({listed}): fit those of one bench."
        )
    return next(iter(values.values()), default)
