"""The queue by itself, in simulated time: who is next, and what nobody may."""

import datetime
import random

import pytest
from rotflex_rig.queue import NEW, STUDENT, WORKER, Queue, Refused

BENCH = {"name": "north"}
MONDAY = datetime.datetime(2026, 11, 30, 10).timestamp()
SECONDS = {"sweep": 15.0, "tracking": 10.0}


class Time:
    """The time, which a test sets."""

    def __init__(self):
        self.now = MONDAY

    def __call__(self):
        return self.now


@pytest.fixture
def time():
    return Time()


@pytest.fixture
def queue(tmp_path, time):
    (tmp_path / "rig.toml").write_text(NEW)
    made = Queue(tmp_path, time)
    made.confirm_presence()
    made.take("here", BENCH)
    return made


def put(queue, student, text="a", seconds=10.0):
    return queue.put(student, text.encode(), "tracking", seconds)


class Laboratory:
    """A bench and its worker, in simulated time. Between two runs there are ``between`` s: twin, mark, rest."""

    def __init__(self, queue, time, between):
        self.queue, self.time, self.between = queue, time, between
        self.busy = self.waited = 0.0
        self.begun = []
        self.unfair = []

    def step(self):
        """Make a run, or wait a second."""
        self.queue.confirm_presence()
        waiting = {one["student"] for one in self.queue.order()}
        fresh = waiting - set(self.begun)
        before = self.time.now
        run = self.queue.take("here", BENCH)
        if run is None:
            self.time.now += 1.0
            return
        if run["student"] in self.begun and fresh:
            self.unfair.append(run["student"])
        self.begun.append(run["student"])
        self.time.now += self.between + run["seconds"]
        self.queue.finish("here", run["id"], b"recording")
        self.busy += run["seconds"]
        self.waited += self.time.now - before


@pytest.mark.parametrize("between", [0.9, 1.7])
def test_sixty_students_with_two_runs_each_are_served_in_turn(queue, time, between):
    """One sends again and again; the others come at random times within half an hour. Measured: 0.9 s between runs."""
    draw = random.Random(64)
    coming = sorted(
        (MONDAY + draw.uniform(0, 1800), f"student-{n}", kind, seconds)
        for n in range(59)
        for kind, seconds in SECONDS.items()
    )
    laboratory, greedy = Laboratory(queue, time, between), 0
    while time.now < MONDAY + 3600:
        while coming and coming[0][0] <= time.now:
            _when, student, kind, seconds = coming.pop(0)
            queue.put(student, kind.encode(), kind, seconds)
        while sum(one["student"] == "greedy" for one in queue.order()) < 3:
            greedy += 1
            queue.put("greedy", str(greedy).encode(), "sweep", 15.0)
        laboratory.step()
    assert laboratory.unfair == []
    assert all(laboratory.begun.count(f"student-{n}") == 2 for n in range(59))
    assert laboratory.busy / laboratory.waited > 0.85


@pytest.mark.parametrize(
    "settings",
    ["", "most_waiting = 3", "hours = 3\nmost_waiting = 3", "most_waiting = 3\n[hours]\nMon = ['08:00', '18:00']",
     "most_waiting = 3\n[hours]\nMonday = [08:00:00, 18:00:00]", "most_waiting = 3\n[hours]\nMon = 08:00:00", "["],
)  # fmt: skip
def test_settings_that_cannot_be_are_refused_before_anybody_is_served(tmp_path, settings):
    (tmp_path / "rig.toml").write_text(settings)
    with pytest.raises(Refused):
        Queue(tmp_path)


def test_next_is_who_had_the_fewest_seconds_today_and_yesterday_does_not_count(queue, time):
    put(queue, "ada", "yesterday", 60.0)
    run = queue.take("here", BENCH)
    time.now += 60
    queue.finish("here", run["id"], b"recording")
    put(queue, "ada")
    put(queue, "ben")
    assert [one["student"] for one in queue.order()] == ["ben", "ada"]
    time.now += 86400
    assert [one["student"] for one in queue.order()] == ["ada", "ben"]


def test_the_same_run_is_found_again_until_it_was_collected_or_withdrawn(queue, time):
    first = put(queue, "ada")
    assert put(queue, "ada") == first
    assert put(queue, "ben") != first
    queue.take("here", BENCH)
    assert put(queue, "ada") == first
    queue.finish("here", first, b"recording")
    assert put(queue, "ada") == first
    assert queue.recording("ada", first) == b"recording"
    queue.let_go("ada", first)
    second = put(queue, "ada")
    assert second != first
    queue.let_go("ada", second)
    assert queue.status("ada", second)["state"] == "withdrawn"
    assert put(queue, "ada") not in (first, second)


def test_what_was_sent_is_kept_only_as_long_as_it_may_run(queue, tmp_path):
    for n in range(20):
        queue.let_go("ada", queue.put("ada", b"%d" % n * 100_000, "tracking", 10.0))
    assert queue._rows("SELECT SUM(LENGTH(body)) FROM runs")[0][0] == 0


def test_nobody_has_more_waiting_than_allowed_or_sees_runs_of_others(queue):
    for text in "abc":
        mine = put(queue, "ada", text)
    with pytest.raises(Refused) as refused:
        put(queue, "ada", "d")
    assert refused.value.status == 429
    for act in (queue.status, queue.let_go, queue.recording):
        with pytest.raises(Refused) as refused:
            act("ben", mine)
        assert refused.value.status == 404


def test_runs_are_begun_in_the_hours_with_somebody_there_and_unless_it_is_paused(queue, time):
    put(queue, "ada")

    def begins():
        run = queue.take("here", BENCH)
        if run is not None:
            queue.finish("here", run["id"], {"reason": "to begin again", "moved": False})
            queue.pause("")
        return run is not None

    assert begins()
    time.now += 1801
    assert not begins()  # nobody confirmed
    queue.confirm_presence()
    assert begins()
    queue.confirm_presence(is_there=False)
    assert not begins()
    queue.confirm_presence()
    queue.pause("by ben")
    assert not begins()
    assert "by ben" in queue.status("ada", 1)["held"]
    queue.pause("")
    for hours, day in ((-3, 0), (9, 0), (0, 5)):
        time.now = MONDAY + 3600 * hours + 86400 * day
        queue.confirm_presence()
        assert not begins()
    time.now = MONDAY + 86400
    queue.confirm_presence()
    assert begins()


def test_a_run_during_which_something_died_comes_once_more_and_is_set_aside_then(queue):
    number = put(queue, "ada")
    assert queue.take("here", BENCH)["id"] == number
    assert queue.take("here", BENCH)["id"] == number  # the worker was started again
    assert queue.take("here", BENCH) is None
    assert queue.status("ada", number)["state"] == "aside"


def test_a_run_that_was_withdrawn_on_the_bench_does_not_come_again(queue):
    number = put(queue, "ada")
    queue.take("here", BENCH)
    queue.let_go("ada", number)
    assert queue.take("here", BENCH) is None
    assert queue.order() == []


def test_trouble_before_the_motor_moved_costs_no_try(queue):
    number = put(queue, "ada")
    for _each in range(5):
        assert queue.take("here", BENCH)["id"] == number
        queue.finish("here", number, {"reason": "the arm is elsewhere", "moved": False})
        assert queue.held()
        queue.pause("")


def test_one_bench_has_one_worker_and_a_silent_one_is_followed_by_another(queue, time):
    number = put(queue, "ada", seconds=10.0)
    with pytest.raises(Refused):
        queue.take("there", BENCH)
    queue.take("here", BENCH)
    time.now += 61
    with pytest.raises(Refused):  # the run may still be on the bench
        queue.take("there", BENCH)
    time.now += 40
    assert queue.take("there", BENCH)["id"] == number
    with pytest.raises(Refused):
        queue.finish("here", number, b"recording")
    queue.finish("there", number, b"recording")
    queue.finish("there", number, b"again, for the answer was lost")
    assert queue.recording("ada", number) == b"recording"


def test_tokens_are_of_somebody_and_end(queue, tmp_path):
    token = queue.admit(STUDENT, "ada")["ada"]
    assert queue.admit(STUDENT, "ada", "ben").keys() == {"ben"}  # one who has a token keeps it
    assert queue.who(token, STUDENT) == "ada"
    put(queue, "ada")
    for unknown, role, status in (("rig-x", STUDENT, 401), ("", STUDENT, 401), (token, WORKER, 403)):
        with pytest.raises(Refused) as refused:
            queue.who(unknown, role)
        assert refused.value.status == status
    assert queue.revoke("ada")
    assert queue.order() == []
    with pytest.raises(Refused):
        queue.who(token, STUDENT)
    again = queue.admit(STUDENT, "ada")["ada"]
    assert queue.who(again, STUDENT) == "ada" and again != token
    assert not any(token.encode() in path.read_bytes() for path in tmp_path.rglob("*") if path.is_file())
