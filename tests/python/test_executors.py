"""Workspaces on executors: the same rows to the bit, whatever happens to their workers."""

import multiprocessing
import os
import signal
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)

import pytest

import tdcr
from tdcr._forward import chunks

ROBOT = tdcr.Robot(
    tdcr.Backbone([0.06, 0.06], [4, 4]),
    [tdcr.Tendon(2.1 * k, 0.008, end=end) for end in (4, 8) for k in range(3)],
)
FIELDS = ("energy", "frames")


def sample(samples=1000, **options):
    given = {"model": "constant_curvature", "sampling": "random", "fields": FIELDS, **options}
    return tdcr.workspace(ROBOT, [(-0.004, 0.004)] * 6, samples, **given)


def same_rows(one, other):
    names = ("displacements", "tips", "directions", "codes")
    return all(
        [getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in names]
        + [one.values[name].tobytes() == other.values[name].tobytes() for name in FIELDS]
    )


class Dying(ProcessPoolExecutor):
    """Its third task ends the worker that takes it."""

    tasks = 0

    def submit(self, function, /, *args):
        self.tasks += 1
        return super().submit(*((os._exit, 1) if self.tasks == 3 else (function, *args)))


class Losing(ThreadPoolExecutor):
    """Loses the first tries of the second piece, as a scheduler does whose workers die."""

    def __init__(self, losses):
        super().__init__(2)
        self.losses, self.tasks = losses, 0

    def submit(self, function, /, *args):
        self.tasks += 1
        if self.tasks == 2 or (self.tasks > 10 and self.losses > 0):
            self.losses -= 1
            lost = Future()
            lost.set_exception(RuntimeError("worker lost"))
            return lost
        return super().submit(function, *args)


def spawned(kind=ProcessPoolExecutor):
    return kind(2, mp_context=multiprocessing.get_context("spawn"))


def test_processes_give_the_same_rows():
    told = []
    with spawned() as executor:
        found = sample(chunk=100, executor=executor, progress=told.append)
        rod = sample(60, model="rod", chunk=7, executor=executor)
    assert same_rows(found, sample())
    assert told == list(range(100, 1001, 100))
    assert same_rows(rod, sample(60, model="rod"))


def test_a_dead_worker_costs_no_row():
    with (
        spawned(Dying) as executor,
        pytest.warns(RuntimeWarning, match="executor: broken .*; what is left is solved in this"),
    ):
        found = sample(chunk=100, executor=executor)
    assert same_rows(found, sample())


def test_lost_pieces_are_given_again_but_not_for_ever():
    with Losing(2) as executor:
        assert same_rows(sample(chunk=100, executor=executor), sample())
        assert executor.tasks == 12
    with Losing(3) as executor, pytest.raises(RuntimeError, match="worker lost"):
        sample(chunk=100, executor=executor)


def test_errors_of_a_solve_are_not_tried_again():
    calls = []

    def distance(points):
        calls.append(1)
        raise ZeroDivisionError("mine")

    obstacle = tdcr.SignedDistance(distance)
    with ThreadPoolExecutor(1) as executor, pytest.raises(ZeroDivisionError, match="mine"):
        sample(8, model="rod", obstacles=obstacle, executor=executor)
    assert len(calls) == 1


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_a_dask_cluster_gives_the_same_rows_when_a_worker_is_killed_too():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=":0") as cluster,
        distributed.Client(cluster) as client,
    ):
        found = sample(chunk=100, executor=client.get_executor())
        left = list(client.run(os.getpid).values())[:1]

        def kill(done):
            if left and done >= 300:
                os.kill(left.pop(), signal.SIGKILL)

        killed = sample(chunk=100, executor=client.get_executor(), progress=kill)
        # A cluster that is closed while it replaces a worker waits for half a minute.
        client.wait_for_workers(2, timeout=300)
    assert left == []
    assert same_rows(found, sample())
    assert same_rows(killed, sample())


class Cancelling(ThreadPoolExecutor):
    """Cancels its first tasks, as a scheduler that is restarted does."""

    cancels = 2

    def submit(self, function, /, *args):
        self.cancels -= 1
        if self.cancels < 0:
            return super().submit(function, *args)
        future = Future()
        future.cancel()
        future.set_running_or_notify_cancel()
        return future


def test_cancelled_pieces_are_given_again():
    with Cancelling(2) as executor:
        assert same_rows(sample(chunk=100, executor=executor), sample())
        assert executor.cancels == -10


class Broken(Executor):
    """Takes one task, and no other."""

    tasks = 0

    def submit(self, function, /, *args):
        self.tasks += 1
        if self.tasks > 1:
            raise BrokenExecutor("no worker left")
        done = Future()
        done.set_result(function(*args))
        return done


@pytest.mark.parametrize(("threads", "away", "here"), [(None, 1, None), (2, 2, 2)])
def test_workers_have_a_core_each_and_what_is_left_has_all(threads, away, here, monkeypatch):
    used = []
    solve = tdcr.forward_batch

    def told(*args, **options):
        used.append(options["threads"])
        return solve(*args, **options)

    monkeypatch.setattr(chunks, "forward_batch", told)
    with pytest.warns(RuntimeWarning, match="no worker left"):
        found = sample(chunk=400, executor=Broken(), threads=threads)
    # The first one has no row, and checks what is given.
    assert used == [here, away, here, here]
    assert same_rows(found, sample())


class Keeping(ThreadPoolExecutor):
    """Keeps its futures."""

    def __init__(self):
        super().__init__(1)
        self.futures = []

    def submit(self, function, /, *args):
        self.futures.append(super().submit(function, *args))
        return self.futures[-1]


@pytest.mark.parametrize("error", [LookupError("enough"), KeyboardInterrupt()])
def test_an_error_on_the_way_cancels_what_waits(error):
    def tell(done):
        raise error

    with Keeping() as executor:
        with pytest.raises(type(error)):
            sample(20_000, chunk=200, executor=executor, progress=tell)
        assert sum(future.cancelled() for future in executor.futures) > 32


class Forgetting(ThreadPoolExecutor):
    """Loses what its tasks return."""

    def submit(self, function, /, *args):
        return super().submit(lambda: None)


def test_lost_answers_are_no_rows():
    with Forgetting(1) as executor, pytest.raises(TypeError, match=r"executor: .* got NoneType"):
        sample(executor=executor)


def test_what_is_no_executor_is_said():
    with pytest.raises(TypeError, match=r"executor: expected a concurrent\.futures\.Executor or"):
        sample(executor=3)
