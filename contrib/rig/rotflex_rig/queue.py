"""Who may ask, who is next, and what became of each run: a folder with a database and the recordings.

Next is the run of the student with the fewest seconds at the bench today; of runs of one student, or of students with
equally few, the one that waits longest. Each change is one transaction, so that it does not matter how many processes
serve the queue or when one of them is killed.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import secrets
import sqlite3
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rotflex import files
from rotflex.errors import BenchError
from rotflex_rig.web import UNKNOWN

SETTINGS_FILE, RECORDINGS = "rig.toml", "recordings"
PRESENCE = 1800.0  #: s for which a confirmation counts that somebody is in the laboratory
STUDENT, LABORATORY, WORKER = "student", "laboratory", "worker"  #: who has a token
_TRIES = 2  # of a run during which something died
_OVERHEAD = 3.0  # s between two runs, for the estimate of how long a student waits
_SILENT = 60.0  # s without a word of a worker, after which one on another computer may take its place
_DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
#: The settings of a new rig.
NEW = """\
most_waiting = 3  # runs of one student that may wait at once

[hours]           # when the bench may move, by this computer's clock; no line for days on which it does not
Mon = [08:00:00, 18:00:00]
Tue = [08:00:00, 18:00:00]
Wed = [08:00:00, 18:00:00]
Thu = [08:00:00, 18:00:00]
Fri = [08:00:00, 18:00:00]
"""
_TABLES = """
CREATE TABLE IF NOT EXISTS people (hash TEXT PRIMARY KEY, id TEXT, role TEXT);
CREATE TABLE IF NOT EXISTS runs (
  id INTEGER PRIMARY KEY, student TEXT, key TEXT, body BLOB, name TEXT, seconds REAL, queued REAL, state TEXT,
  tries INTEGER DEFAULT 0, begun REAL, ended REAL, error TEXT, reason TEXT);
CREATE TABLE IF NOT EXISTS rig (
  one INTEGER PRIMARY KEY CHECK (one = 1), paused TEXT, present_until REAL DEFAULT 0, worker TEXT, seen REAL DEFAULT 0,
  bench TEXT);
INSERT OR IGNORE INTO rig (one) VALUES (1);
"""


class Refused(BenchError):
    """What was asked for is not done; ``status`` is the answer's in HTTP."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


class Queue:
    """A rig: its folder, and the time.

    Parameters
    ----------
    folder : with ``rig.toml``; the database is made if it is not there
    now : the time, s since 1970

    Raises
    ------
    Refused
        If the folder is none of a rig's, or its settings cannot be.
    """

    def __init__(self, folder: Path, now: Callable[[], float] = time.time) -> None:
        self._now, self._recordings = now, folder / RECORDINGS
        try:
            settings = tomllib.loads((folder / SETTINGS_FILE).read_text(encoding="utf-8"))
            self._hours = {_DAYS.index(day): (begin, end) for day, (begin, end) in settings["hours"].items()}
            if not all(isinstance(one, datetime.time) for hours in self._hours.values() for one in hours):
                raise TypeError("hours are times, as in Mon = [08:00:00, 18:00:00]")
            self._most_waiting = int(settings["most_waiting"])
        except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
            advice = "rotflex-rig new FOLDER writes these settings where there are none."
            raise Refused(500, f"{folder / SETTINGS_FILE} cannot be used: {error}. {advice}") from None
        self._recordings.mkdir(exist_ok=True)
        self._database = sqlite3.connect(folder / "rig.db", isolation_level=None, check_same_thread=False, timeout=30)
        self._database.row_factory = sqlite3.Row
        self._database.executescript(f"PRAGMA journal_mode=WAL;{_TABLES}")

    @contextmanager
    def _changing(self) -> Iterator[None]:
        with self._database:  # commits, or takes all back
            self._database.execute("BEGIN IMMEDIATE")
            yield

    def _rows(self, sql: str, *values: Any) -> list[sqlite3.Row]:
        return self._database.execute(sql, values).fetchall()

    # --- who may ask ----------------------------------------------------------------------------------------------

    def admit(self, role: str, *who: str) -> dict[str, str]:
        """Return a token for each who has none yet. Only hashes are kept."""
        with self._changing():
            known = {one["id"] for one in self._rows("SELECT id FROM people")}
            made = {one: f"rig-{secrets.token_urlsafe(24)}" for one in who if one not in known}
            for one, token in made.items():
                self._rows("INSERT INTO people VALUES (?, ?, ?)", _hash(token), one, role)
        return made

    def revoke(self, who: str) -> bool:
        """End the tokens of somebody, and withdraw what they have waiting; return whether there was one."""
        with self._changing():
            self._rows("UPDATE runs SET state = 'withdrawn' WHERE student = ? AND state = 'waiting'", who)
            return bool(self._rows("DELETE FROM people WHERE id = ? RETURNING id", who))

    def who(self, token: str, *roles: str) -> str:
        """Return the owner of a token; raises Refused if it is no token of these roles."""
        for person in self._rows("SELECT * FROM people WHERE hash = ?", _hash(token)):
            if person["role"] in roles:
                return str(person["id"])
            raise Refused(403, f"This needs a token of the {' or '.join(roles)}; yours is of the {person['role']}.")
        raise Refused(
            UNKNOWN, "The rig does not know this token, or it was revoked. Ask whoever gave it to you for a new one."
        )

    # --- students -------------------------------------------------------------------------------------------------

    def put(self, student: str, body: bytes, name: str, seconds: float) -> int:
        """Queue a run, and return its number; one that the student sent before and has not collected is found again."""
        key = hashlib.sha256(body).hexdigest()
        with self._changing():
            for run in self._rows(
                "SELECT id FROM runs WHERE student = ? AND key = ? AND state IN ('waiting', 'running', 'done')",
                *(student, key),
            ):
                return int(run["id"])
            waiting = self._rows("SELECT 1 FROM runs WHERE student = ? AND state = 'waiting'", student)
            if len(waiting) >= self._most_waiting:
                raise Refused(429, f"{len(waiting)} runs of yours wait already, which is the most. Let them run first.")
            [made] = self._rows(
                "INSERT INTO runs (student, key, body, name, seconds, queued, state) VALUES (?, ?, ?, ?, ?, ?, "
                "'waiting') RETURNING id",
                *(student, key, body, name, seconds, self._now()),
            )
        return int(made["id"])

    def status(self, student: str, number: int) -> dict[str, Any]:
        """Return what became of a run; while it waits, how many are before it, for how long (s), and what holds up."""
        run = self._own(student, number)
        said = {name: run[name] for name in ("state", "error", "reason")}
        if run["state"] == "waiting":
            order = self.order()
            place = [one["id"] for one in order].index(number)
            seconds = sum(one["seconds"] + _OVERHEAD for one in order[:place])
            under_way = self._rows("SELECT seconds FROM runs WHERE state = 'running'")
            said |= {"before": place + len(under_way), "seconds": seconds + sum(one["seconds"] for one in under_way)}
            said["held"] = self.held()
        return said

    def let_go(self, student: str, number: int) -> None:
        """Forget a run for its student, who has the recording, or wants it no more: the same call is a new run then."""
        self._own(student, number)
        with self._changing():
            self._rows("UPDATE runs SET state = 'withdrawn' WHERE id = ? AND state = 'waiting'", number)
            self._rows("UPDATE runs SET key = '', body = '' WHERE id = ?", number)

    def recording(self, student: str, number: int) -> bytes:
        """Return the recording of a run that is done."""
        if self._own(student, number)["state"] != "done":
            raise Refused(404, "This run has no recording.")
        return self.recording_file(number).read_bytes()

    def recording_file(self, number: int) -> Path:
        """Return the file of a run's recording."""
        return self._recordings / f"{number:06d}.npz"

    def _own(self, student: str, number: int) -> sqlite3.Row:
        for run in self._rows("SELECT * FROM runs WHERE id = ? AND student = ?", number, student):
            return run
        raise Refused(404, "You have no run of this number.")

    # --- the order ------------------------------------------------------------------------------------------------

    def order(self) -> list[sqlite3.Row]:
        """Return the runs that wait, the next one first."""
        today = datetime.datetime.fromtimestamp(self._now()).replace(hour=0, minute=0, second=0).timestamp()
        spent = self._rows(
            "SELECT student, SUM(COALESCE(ended, begun + seconds) - begun) AS spent FROM runs WHERE begun >= ? "
            "GROUP BY student",
            today,
        )
        used = {one["student"]: one["spent"] for one in spent}
        left = self._rows("SELECT * FROM runs WHERE state = 'waiting' ORDER BY queued, id")
        ordered = []
        while left:
            first = min(left, key=lambda one: used.get(one["student"], 0.0))  # of equal ones the first
            left.remove(first)
            used[first["student"]] = used.get(first["student"], 0.0) + first["seconds"]
            ordered.append(first)
        return ordered

    def held(self) -> str:
        """Return all reasons why no run is begun now; "" if runs are begun."""
        [rig] = self._rows("SELECT * FROM rig")
        now = datetime.datetime.fromtimestamp(self._now())
        begin, end = self._hours.get(now.weekday(), (datetime.time.max, datetime.time.max))
        is_alive = rig["seen"] > self._now() - _SILENT or self._rows("SELECT 1 FROM runs WHERE state = 'running'")
        reasons = {
            "the laboratory is closed at this hour": not begin <= now.time() < end,
            "nobody in the laboratory has confirmed that they are there": rig["present_until"] < self._now(),
            "the bench's computer is silent": not is_alive,
            f"the rig is paused: {rig['paused']}": rig["paused"],
        }
        return "; ".join(text for text, holds in reasons.items() if holds)

    # --- the worker -----------------------------------------------------------------------------------------------

    def take(self, worker: str, bench: dict[str, Any]) -> sqlite3.Row | None:
        """Return the next run for the worker of the bench; None if there is none now.

        What it has not finished died with it: such a run comes once more, and is set aside after that.

        Parameters
        ----------
        worker : stays the same when the worker is started again on its computer
        bench : what students' computers need to know of it

        Raises
        ------
        Refused
            If another worker has the bench.
        """
        with self._changing():
            [rig] = self._rows("SELECT * FROM rig")
            due = (
                self._rows("SELECT MAX(begun + 3 * seconds) AS due FROM runs WHERE state = 'running'")[0]["due"] or 0.0
            )
            if rig["worker"] not in (None, worker) and self._now() < max(rig["seen"], due) + _SILENT:
                raise Refused(409, "Another computer works for this rig. One bench has one worker: end one of the two.")
            self._rows("UPDATE rig SET worker = ?, seen = ?, bench = ?", worker, self._now(), json.dumps(bench))
            self._put_back("It was begun, and the bench's computer stopped.")
            if self.held():
                return None
            for run in self.order():
                [taken] = self._rows(
                    "UPDATE runs SET state = 'running', tries = tries + 1, begun = ?, ended = NULL "
                    "WHERE id = ? AND state = 'waiting' RETURNING *",
                    *(self._now(), run["id"]),
                )
                return taken
        return None

    def finish(self, worker: str, number: int, outcome: bytes | dict[str, Any]) -> None:
        """Note what became of a run.

        Parameters
        ----------
        worker, number : who made it, and which one
        outcome : the recording; or "reason" and "error", the reason's class, of a run that is refused; or "reason" and
            "moved" of trouble at the bench. Then the rig is paused, and the run comes again: once, if the motor moved

        Raises
        ------
        Refused
            If another worker has the bench by now.
        """
        with self._changing():
            runs = self._rows("SELECT state FROM runs, rig WHERE runs.id = ? AND rig.worker = ?", number, worker)
            if not runs:
                raise Refused(409, "Another computer works for this rig by now.")
            if runs[0]["state"] != "running":
                return  # it was noted, and the answer was lost
            if isinstance(outcome, bytes):
                files.write(self.recording_file(number), outcome)
                self._end(number, "done")
            elif "moved" in outcome:
                self._rows("UPDATE runs SET tries = tries - ? WHERE id = ?", not outcome["moved"], number)
                self._put_back(outcome["reason"])
                self._rows("UPDATE rig SET paused = ?", outcome["reason"])
            else:
                self._end(number, "refused", outcome["error"], outcome["reason"])

    def is_wanted(self, number: int) -> bool:
        """Return whether the student of a run still waits for it."""
        return bool(self._rows("SELECT 1 FROM runs WHERE id = ? AND key <> ''", number))

    def _end(self, number: int, state: str, error: str = "", reason: str = "") -> None:
        ended = state, self._now(), error, reason, number
        self._rows("UPDATE runs SET state = ?, ended = ?, error = ?, reason = ?, body = '' WHERE id = ?", *ended)

    def _put_back(self, reason: str) -> None:
        self._rows(
            "UPDATE runs SET begun = NULL, reason = ?2, state = CASE WHEN key = '' THEN 'withdrawn' "
            "WHEN tries < ?1 THEN 'waiting' ELSE 'aside' END WHERE state = 'running'",
            *(_TRIES, f"{reason} It was tried {_TRIES} times."),
        )

    # --- the laboratory -------------------------------------------------------------------------------------------

    def pause(self, reason: str) -> None:
        """Begin no more runs; "" goes on."""
        self._rows("UPDATE rig SET paused = ?", reason)

    def confirm_presence(self, is_there: bool = True) -> None:
        """Note that somebody is in the laboratory, or leaves it."""
        self._rows("UPDATE rig SET present_until = ?", self._now() + PRESENCE if is_there else 0.0)

    def bench(self) -> dict[str, Any]:
        """Return what the worker said of the bench."""
        [rig] = self._rows("SELECT bench FROM rig")
        if rig["bench"] is None:
            raise Refused(409, "The bench's computer has not come to this rig yet. Ask the laboratory.")
        return dict(json.loads(rig["bench"]))

    def overview(self) -> dict[str, Any]:
        """Return the queue, the last runs, and the state of the rig, for the page."""
        [rig] = self._rows("SELECT * FROM rig")
        shown = ("id", "student", "name", "seconds", "state", "reason")
        last = self._rows("SELECT * FROM runs WHERE state NOT IN ('waiting', 'running') ORDER BY ended DESC LIMIT 12")
        under_way = self._rows("SELECT * FROM runs WHERE state = 'running'")
        return {
            "held": self.held(),
            "paused": rig["paused"] or "",
            "present": max(rig["present_until"] - self._now(), 0.0),
            "queue": [{name: one[name] for name in shown} for one in (*under_way, *self.order())],
            "last": [{name: one[name] for name in shown} for one in last],
        }

    def recorded(self) -> dict[int, tuple[str, Path]]:
        """Return the student and the file of each run that has a recording, by number."""
        done = self._rows("SELECT id, student FROM runs WHERE state = 'done'")
        return {one["id"]: (one["student"], self.recording_file(one["id"])) for one in done}


def _hash(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()
