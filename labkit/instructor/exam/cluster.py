"""The same grading on a Dask cluster: each worker machine has the full kit, and grades batches with it."""

import functools
from collections.abc import Iterator, Sequence

from ..records import CommandError
from ..sandbox.launch import Sandbox
from . import paper
from .jobs import Job, Room, batches
from .pool import Local, News

ANSWER = 20  # seconds that a scheduler may take to answer


def remote(room: Room, jobs: Sequence[Job], address: str) -> Iterator[News]:
    """Grade on the cluster whose scheduler is at `address`; yields as Local.grade does.

    A machine that dies costs the time of its batch: Dask gives that to another. Raises CommandError.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise CommandError(
            "--scheduler needs the package distributed: pip install 'robot-localization-labkit[cluster]'."
        ) from None
    try:
        client = Client(address, timeout=f"{ANSWER}s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise CommandError(f"No Dask scheduler answers at {address} ({error}).") from None
    with client:
        workers = max(1, sum(client.nthreads().values()))
        waiting: dict = {
            client.submit(grade_there, room, [job.packed() for job in part], pure=False, retries=2): part
            for part in batches(jobs, workers)
        }
        for future in as_completed(waiting, loop=client.loop):
            if future.status == "finished":
                yield from future.result()
            else:
                for job in waiting[future]:
                    yield "lost", job.id, f"The cluster could not grade it: {future.exception()}"
            waiting[future] = None


def grade_there(room: Room, jobs: Sequence[Job]) -> list[News]:
    """What a worker of the cluster does with a batch: a list of what Local.grade yields."""
    if paper.read(room.paper.lab).digest != room.paper.digest:
        raise CommandError("a worker has another version of the kit: update it to the one that you grade with")
    level = sandbox_here()
    if level.level < room.way["level"]:
        raise CommandError(f"a worker has only sandbox level {level.level}, and {room.way['level']} was asked for")
    return list(here().grade(room.at(level), jobs))


@functools.cache
def here() -> Local:
    """The grading process of this machine, kept for the next batch."""
    return Local(1)


@functools.cache
def sandbox_here() -> Sandbox:
    """The best sandbox of this machine."""
    from ..sandbox.choose import look

    return max((found.sandbox for found in look() if found.sandbox), key=lambda sandbox: sandbox.level)
