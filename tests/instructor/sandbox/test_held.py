"""What a student's code tries in each sandbox of this machine, one thing at a time: what is closed, and what works."""

import os
import subprocess
import sys
import textwrap
import time
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from labkit.instructor import folders
from labkit.instructor.sandbox import account, calls, space
from labkit.instructor.sandbox.channel import Channel, WorkerLostError
from labkit.instructor.sandbox.choose import look
from labkit.instructor.sandbox.confine import load
from labkit.instructor.sandbox.forms import fields, result
from labkit.instructor.sandbox.launch import make_runtime
from labkit.instructor.sandbox.proxy import load_form

from helpers.reference import ROOT

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the sandboxes are Linux's")


@pytest.fixture(scope="module")
def ways():
    return {found.sandbox.level: found.sandbox for found in look() if found.sandbox}


@pytest.fixture(scope="module", params=[4, 3, 2])
def sandbox(request, ways):
    if request.param not in ways:
        pytest.skip(f"this machine has no sandbox of level {request.param}")
    with folders.temporary("test") as folder:
        yield replace(ways[request.param], runtime=make_runtime(f"{folder}/runtime"))


@contextmanager
def worker(sandbox, code):
    """The channel of a worker that has a function `attempt` with this code."""
    channel = Channel(sandbox, 60)
    try:
        channel.settle()
        source = f"def attempt():\n{textwrap.indent(textwrap.dedent(code), '    ')}"
        cell = {"number": 1, "id": "one", "role": "own", "code": True, "source": source}
        request = {"do": "load", "cells": [cell], "given": [], "files": {}, "wanted": ["attempt"]}
        assert channel.ask(request, 10, load_form(["attempt"]))["kinds"] == {"attempt": "function"}
        yield channel
    finally:
        channel.end()


def attempt(sandbox, code):
    """What `attempt` returns."""
    with worker(sandbox, code) as channel:
        request = {"do": "call", "name": "attempt", "args": [], "options": {}}
        return channel.ask(request, 20, fields(value=result))["value"]


WORKS = {
    "linear algebra": "import numpy as np, scipy.linalg as l\nreturn bool(np.allclose(l.inv(np.eye(300)), np.linalg.svd(np.eye(300))[0]))",
    "statistics": "import scipy.stats, scipy.optimize\nreturn bool(abs(scipy.optimize.brentq(lambda x: scipy.stats.chi2(2).cdf(x) - 0.5, 0, 9) - 1.386) < 1e-3)",
    "threads": "from concurrent.futures import ThreadPoolExecutor as T\nwith T(8) as pool: return sum(pool.map(abs, range(99))) == 4851",
    "waiting": "import threading, queue\ntry: queue.Queue().get(timeout=0.01)\nexcept queue.Empty: return not threading.Event().wait(0.01)",
    "time": "import time, datetime\nreturn time.perf_counter() > 0 and time.process_time() > 0 and datetime.datetime.now().year > 2000",
    "paths": "from pathlib import Path\np = Path('a/b'); p.mkdir(parents=True); (p / 'c').write_text('x'); (p / 'c').touch(); return (p / 'c').rename('d').read_text() == 'x'",
    "temporary files": "import tempfile\nwith tempfile.TemporaryDirectory() as f, tempfile.NamedTemporaryFile(dir=f) as g: return g.write(b'x') == 1",
    "copied files": "import shutil, os\nopen('e', 'w').write('x'); shutil.copy('e', 'f'); shutil.copy2('e', 'g'); return os.path.getsize(shutil.move('g', 'h')) == 1",
    "archives": "import zipfile\nopen('e', 'w').write('x')\nwith zipfile.ZipFile('z', 'w') as z: z.write('e')\nzipfile.ZipFile('z').extractall('out'); return open('out/e').read() == 'x'",
    "arrays in files": "import numpy as np\nnp.save('x.npy', np.eye(3)); return float(np.load('x.npy', mmap_mode='r').sum()) == 3",
    "a database": "import sqlite3\nwith sqlite3.connect('x.db') as d: d.execute('create table a (b)'); return d.execute('select count(*) from a').fetchone()[0] == 0",
    "pictures": "import matplotlib.pyplot as p\np.plot([1, 2]); p.savefig('x.png'); import os; return os.path.getsize('x.png') > 1000",
    "random numbers": "import random, secrets, uuid, numpy as np\nreturn len(secrets.token_bytes(8)) == 8 and np.random.default_rng().random() < 1 and uuid.uuid4().version == 4",
    "processors": "import os, multiprocessing\nreturn (os.cpu_count() or 1) >= 1 and multiprocessing.cpu_count() >= 1 and len(os.sched_getaffinity(0)) >= 1",
    "its own limits": "import resource\nreturn resource.getrlimit(resource.RLIMIT_NOFILE)[0] == 256",
    "mapped memory": "import mmap\nm = mmap.mmap(-1, 4096); m[:2] = b'ok'; return m[:2] == b'ok'",
    "who it is": "import getpass, os, platform\nreturn os.getpid() > 0 and platform.machine() != '' and os.getcwd() == os.environ['HOME']",
}


@pytest.mark.parametrize("what", WORKS)
def test_what_honest_answers_use_works(sandbox, what):
    assert attempt(sandbox, WORKS[what]) is True


def test_every_call_on_the_list_is_one():
    """On one of the two processors that students' and instructors' machines have."""
    (seccomp,) = load("pyseccomp")
    if seccomp is None:
        pytest.skip("the package pyseccomp does not work here")
    named = [*calls.ALLOWED.values(), calls.IN_APPEARANCE, calls.NO_ATTRIBUTES, *calls.MEANINGS]
    unknown = set()
    for name in " ".join(named).split():
        numbers = []
        for processor in (seccomp.Arch.X86_64, seccomp.Arch.AARCH64):
            with suppress(OSError, ValueError):
                numbers.append(seccomp.resolve_syscall(processor, name))
        unknown |= {name} if max(numbers, default=-1) < 0 else set()
    assert unknown <= {"mseal", "futex_wake", "futex_wait", "futex_requeue"}  # newer than the library, perhaps


OUTSIDE = """
import ctypes, os, resource
libc, path, other = ctypes.CDLL(None, use_errno=True), {path!r}, {pid}
held = os.open('/usr', os.O_RDONLY)
tries = [
    lambda: os.chmod(path, 0o666), lambda: os.chmod(path, 0o666, dir_fd=held), lambda: os.chown(path, -1, -1),
    lambda: os.utime(path, (1, 1)), lambda: os.utime(path), lambda: os.truncate(path, 0), lambda: os.remove(path),
    lambda: os.setxattr(path, 'user.x', b'1'), lambda: os.removexattr(path, 'user.kept'), lambda: os.rename(path, path + '2'),
    lambda: os.link(path, 'mine'), lambda: os.symlink('x', path + '3'), lambda: os.mkdir(path + '4'),
    lambda: os.mkfifo(path + '5'), lambda: libc.syscall(452, -100, path.encode(), 0o666, 0),
    lambda: libc.syscall(463, -100, path.encode(), 0, b'user.y', None, 0),
]
for one in tries:
    try: one()
    except OSError: pass
return True
"""


def test_no_other_file_is_changed(sandbox, tmp_path):
    """Rights, times and attributes, too: of one's own files, where the instructor grades as himself."""
    path = tmp_path / "grades.csv"
    path.write_text("Ada,20")
    path.chmod(0o600)
    for folder in (tmp_path, *tmp_path.parents):
        if folder.stat().st_uid == os.geteuid():
            folder.chmod(folder.stat().st_mode | 0o011)
    about, beside = path.stat(), os.listdir(tmp_path)
    assert attempt(sandbox, OUTSIDE.format(path=str(path), pid=os.getpid())) is True
    now = path.stat()
    fields = ("st_mode", "st_uid", "st_gid", "st_size", "st_mtime_ns", "st_ctime_ns", "st_nlink")
    assert [(name, getattr(now, name)) for name in fields] == [(name, getattr(about, name)) for name in fields]
    assert os.listdir(tmp_path) == beside and path.read_text() == "Ada,20"


OTHERS = {
    "prlimit": "resource.prlimit(other, resource.RLIMIT_CPU, (1, 1))",
    "prlimit to read": "resource.prlimit(other, resource.RLIMIT_CPU)",
    "setpriority": "os.setpriority(os.PRIO_PROCESS, other, 19)",
    "setpriority of all": "os.setpriority(os.PRIO_USER, os.getuid(), 19)",
    "affinity": "os.sched_setaffinity(other, [0])",
    "scheduler": "os.sched_setscheduler(other, os.SCHED_BATCH, os.sched_param(0))",
    "sched_setattr": "call(314, other, bytes([48]) + bytes(47), 0)",
    "ioprio_set": "call(251, 1, other, 0x6000)",
    "kill": "os.kill(other, 0)",
    "tgkill": "call(234, other, other, 0)",
    "tkill": "call(200, other, 0)",
    "killpg": "os.killpg(os.getpgid(0), 0)",
    "pidfd": "os.pidfd_open(other)",
    "a pipe's owner": "r, w = os.pipe(); fcntl.fcntl(r, fcntl.F_SETOWN, other)",
    "memory": "call(310, other, None, 0, None, 0, 0)",
    "migrate_pages": "call(256, other, 0, None, None)",
    "kcmp": "call(312, other, other, 0, 0, 0)",
    "ptrace": "call(101, 16, other, 0, 0)",
    "process_mrelease": "call(448, -1, 0)",
    "its parent's death": "call(157, 1, 0)",
    "its own limits": "resource.setrlimit(resource.RLIMIT_CPU, (1, 1))",
    "a signal queued": "call(129, other, 1, None)",
    "a call that is not invented yet": "call(999)",
    "a clone": "call(56, 17, 0, 0, 0, 0)",
    "shared memory": "call(29, 0, 4096, 0o1600)",
    "memory without a file": "os.memfd_create('x')",
    "space that nobody wrote": "os.posix_fallocate(os.open('f', 66), 0, 4096)",
    "a larger pipe": "r, w = os.pipe(); fcntl.fcntl(w, 1031, 2**20)",
    "asynchronous input": "call(206, 100, bytes(8))",
    "all disks written": "call(162) == 0 and None",
    "its dumpability": "call(157, 4, 0, 0, 0, 0)",
}


@pytest.mark.skipif(os.uname().machine != "x86_64", reason="these are its numbers of system calls")
@pytest.mark.parametrize("what", OTHERS)
def test_no_other_process_is_reached_and_nothing_escapes_the_limits(sandbox, what):
    code = f"""
import ctypes, fcntl, os, resource
other = {os.getpid()}
def call(*arguments):
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(*arguments) < 0: raise OSError(ctypes.get_errno(), 'refused')
try:
    {OTHERS[what]}
except OSError as error:
    return error.errno
return 0
"""
    assert attempt(sandbox, code) != 0


def test_threads_are_capped(sandbox):
    code = """
    import threading
    threading.stack_size(2**16)
    over, begun = threading.Event(), 0
    try:
        while begun < 2000:
            threading.Thread(target=over.wait, daemon=True).start()
            begun += 1
    except RuntimeError:
        pass
    over.set()
    return begun
    """
    alone = sandbox.way == "bubblewrap" or os.geteuid() == 0
    assert 8 <= attempt(sandbox, code) <= (account.THREADS if alone else account.MORE)


FILLED = {
    "deleted files": "f = os.open(f'f{n}', 66); os.remove(f'f{n}'); os.write(f, bytes(2**23))",
    "many files": "open(f'f{n}', 'w').close()",
    "deep folders": "os.mkdir(f'd'); os.chdir('d')",
    "folders with long names": "os.mkdir('d' * 250); os.chdir('d' * 250)",
    "closed folders": "os.mkdir(f'd{n}', 0o300); open(f'd{n}/f', 'w').close()",
    "links": "os.symlink('x', f'l{n}')",
    "mapped deleted files": "f = os.open(f'f{n}', 66); os.ftruncate(f, 2**23); m.append(mmap.mmap(f, 2**23)); "
    "os.remove(f'f{n}'); os.close(f); m[-1].write(bytes(2**23))",
}


@pytest.mark.parametrize("what", FILLED)
def test_what_it_keeps_in_files_is_capped(sandbox, what):
    code = f"""
    import mmap, os, threading
    n, m = 0, []
    try:
        for n in range(20000):
            {FILLED[what]}
            if n % 50 == 7: threading.Event().wait(0.02)
    except (OSError, ValueError):
        pass
    threading.Event().wait(1)
    return n
    """
    with worker(sandbox, code) as channel:
        request = {"do": "call", "name": "attempt", "args": [], "options": {}}
        got, lost = 0, ""
        try:
            got = channel.ask(request, 20, fields(value=result))["value"]
        except WorkerLostError as error:
            lost = str(error)
        if channel.worker.watch.full:
            assert "leave out what it writes into files" in lost
        else:  # there is no more to be had
            assert sandbox.way == "bubblewrap" and ("SIGBUS" in lost or not lost and got * 2**23 <= space.BYTES)


def test_nothing_can_be_written_but_the_scratch_folder(sandbox):
    code = """
    import os
    home, found = os.path.realpath('.'), []
    for top in ('/', '/dev', '/dev/shm', '/tmp', '/var/tmp', '/run', '/proc', '/sys', '/etc', '/home', '/usr', '/root'):
        for place, folders, files in os.walk(top):
            if place.startswith(home) and place != '/tmp' or place.count('/') > 3: folders.clear()
            try: os.close(os.open(os.path.join(place, 'x'), os.O_CREAT | os.O_WRONLY)); found.append(os.path.realpath(place))
            except OSError: pass
    return sorted(set(found) - {home})
    """
    assert attempt(sandbox, code) == []


@pytest.mark.parametrize("how", ["loops", "sleeps"])
def test_a_worker_ends_with_the_grader(ways, sandbox, how):
    """Killed, under a process that takes orphans in."""
    code = f"""
    import os, sys, threading
    sys.path.insert(0, {str(Path(__file__).parent)!r})
    sys.path.insert(0, {str(ROOT / "tests")!r})
    import test_held as held
    from labkit.instructor.sandbox.launch import Sandbox
    body = "while True: pass" if {how!r} == "loops" else "import threading; threading.Event().wait(99)"
    with held.worker({sandbox!r}, body) as channel:
        threading.Timer(0.5, lambda: (print(*held.those(channel)), sys.stdout.flush(), os._exit(9))).start()
        channel.ask({{"do": "call", "name": "attempt", "args": [], "options": {{}}}}, 60, held.fields(value=held.result))
    """
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], env=env, capture_output=True, text=True)
    numbers = [int(number) for number in done.stdout.split()]
    assert done.returncode == 9 and numbers, done.stderr
    stop = time.monotonic() + 5
    while any(map(running, numbers)) and time.monotonic() < stop:
        time.sleep(0.05)
    assert not any(map(running, numbers))


def those(channel):
    """The numbers of a worker's processes."""
    top = psutil.Process(channel.worker.process.pid)
    return [process.pid for process in (top, *top.children(recursive=True))]


def running(number):
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
