"""Submissions that mean no good or went wrong, each with its expected outcome in a line.

A case is (name, what the answer cell of KF begins with, what replaces the filter, outcome, words of the reason).
outcome: which checks pass, by what they are about: 'parts' are stack and repeat_R, 'check' is the
notebook's own check of KF, 'filter' the hidden ones and 'blind' the one of them that a right `predict` alone
passes.
"""

import json
import re
import textwrap

from helpers.classroom import LAB, answers, as_file, filled
from helpers.reference import ROOT

ALL = frozenset({"parts", "check", "filter", "blind"})
PARTS, BLIND, NONE = frozenset({"parts"}), frozenset({"parts", "blind"}), frozenset()

# The tables that students have on their disk anyway: what an answer gives that only looks things up.
TABLE = json.loads((ROOT / "labkit" / "checks" / "data" / "cartesian-repeat.json").read_text(encoding="utf-8"))
LOOKED_UP = {
    json.dumps(call[1:]): value for s in TABLE["scenarios"] for call, (value,) in zip(s["calls"], s["right"][0][0])
}


def predict(body):
    """The code that replaces `predict` by a body of one line."""
    return f"def predict(self, u):\n    {body}\nKF.predict = predict"


def update(body):
    return f"def update(self, y):\n    {body}\nKF.update = update"


NOTHING = update("pass")
STUCK = "still running when it"
ENDED = "ended Python itself"

WORKER = "import labkit.instructor.sandbox.worker as w"

CODE = [
    # It goes on for ever.
    ("loop at the top", "while True: pass", "", PARTS, "is not there"),
    ("loop in predict", "", predict("while True: pass"), PARTS, STUCK),
    (
        "loop that ignores signals",
        "import signal\nfor s in (2, 14, 15): signal.signal(s, signal.SIG_IGN)\nwhile True: pass",
        "",
        PARTS,
        "is not there",
    ),
    ("sleep", "import time", predict("time.sleep(1000)"), PARTS, ""),  # nobody waits there
    ("waits", "import threading", predict("threading.Event().wait(1000)"), PARTS, STUCK),
    (
        "loop in an exception's text",
        "class E(Exception):\n    def __str__(self):\n        while True: pass",
        predict("raise E"),
        PARTS,
        STUCK,
    ),
    (
        "loop at the end of an object",
        "class D:\n    def __del__(self):\n        while True: pass",
        predict("D()"),
        PARTS,
        STUCK,
    ),
    (
        "catches everything and goes on",
        "",
        predict("\n    while True:\n        try:\n            while True: pass\n        except BaseException: pass"),
        PARTS,
        STUCK,
    ),
    # It ends Python.
    ("exit at the top", "import sys; sys.exit(0)", "", PARTS, "is not there"),
    ("_exit at the top", "import os; os._exit(0)", "", NONE, ENDED),
    ("_exit in predict", "import os", predict("os._exit(0)"), PARTS, ENDED),
    ("abort", "import os", predict("os.abort()"), PARTS, ENDED),
    ("segmentation fault", "import ctypes", predict("ctypes.string_at(0)"), PARTS, ENDED),
    ("kills its parent", "import os", predict("os.kill(os.getppid(), 9)"), PARTS, "stopped"),
    ("kills process 1", "import os", predict("os.kill(1, 9)"), PARTS, "stopped"),
    ("kills everything", "import os", predict("os.kill(-1, 9)"), PARTS, "stopped"),
    ("raises KeyboardInterrupt", "", predict("raise KeyboardInterrupt"), PARTS, "stopped"),
    ("raises an exception of its own root", "class E(BaseException): pass", predict("raise E"), PARTS, ""),
    ("quits", "", predict("quit()"), PARTS, "exit"),
    # It wants too much.
    ("a list without end", "", predict("x = []\n    while True: x += [0] * 10**6"), PARTS, ""),
    ("a huge array", "import numpy as np", predict("np.ones(10**12)"), PARTS, "MemoryError"),
    ("a string of 4 GB", "", predict("'x' * 2**32"), PARTS, "MemoryError"),
    ("fork bomb", "import os", predict("\n    while True: os.fork()"), PARTS, "stopped"),
    (
        "threads",
        "import threading, time",
        predict("\n    while True: threading.Thread(target=time.sleep, args=(99,)).start()"),
        PARTS,
        "",
    ),
    (
        "fills the scratch folder",
        "",
        predict("\n    with open('f', 'wb') as f:\n        while True: f.write(b'x' * 10**6)"),
        PARTS,
        "stopped",
    ),
    ("thousands of files", "", predict("\n    for i in range(10**9): open(f'f{i}', 'w').write('x')"), PARTS, ""),
    (
        "holds files that are deleted",
        "import os",
        predict(
            "\n    for i in range(99):\n        f = os.open('f', 66); os.remove('f'); os.write(f, bytes(2**23))\n    while True: pass"
        ),
        PARTS,
        "",
    ),
    (
        "a folder without a bottom",
        "import os",
        predict("\n    while True: os.mkdir('d' * 250); os.chdir('d' * 250)"),
        PARTS,
        "",
    ),
    ("prints without end", "", predict("\n    while True: print('x' * 1000)"), PARTS, ""),
    ("prints 100 MB first", "print('x' * 10**8)", "", ALL, ""),
    ("warns without end", "import warnings", predict("\n    while True: warnings.warn('x')"), PARTS, STUCK),
    ("recursion", "", predict("self.predict(u)"), PARTS, "calls itself without an end"),
    ("recursion in C", "import sys; sys.setrecursionlimit(10**9)", predict("self.predict(u)"), PARTS, ""),
    ("an answer of 100 MB", "import numpy as np", predict("self.xk_k = np.ones(10**7)"), PARTS, ""),
    ("a nest of lists", "", predict("x = []\n    for i in range(10**5): x = [x]\n    self.xk_k = x"), PARTS, ""),
    ("input()", "", predict("input('?')"), PARTS, ""),
    # It reaches out.
    ("reads the password file", "", predict("open('/etc/passwd').read()"), PARTS, "stopped"),
    ("reads the solution", "", predict("open(SOLUTION).read()"), PARTS, "stopped"),
    (
        "reads the checks' numbers",
        "from labkit.checks import stored",
        predict("stored('cartesian-kf')['mistakes'][0]['id']"),
        PARTS,
        "stopped",
    ),
    ("imports the grader's reference", "", predict("from labkit.instructor.exam.exam import Exam"), PARTS, "stopped"),
    ("writes beside the grader", "", predict("open(CANARY + '/written', 'w').write('x')"), PARTS, "stopped"),
    ("changes the kit", "import labkit", predict("open(labkit.__file__, 'a').write('x')"), PARTS, "stopped"),
    ("removes the grader's folder", "import os", predict("os.rmdir(CANARY)"), PARTS, "stopped"),
    (
        "connects to the network",
        "import socket",
        predict("socket.create_connection(('192.0.2.1', 80), 2)"),
        PARTS,
        "stopped",
    ),
    ("listens on a port", "import socket", predict("socket.create_server(('127.0.0.1', 0))"), PARTS, "stopped"),
    ("starts a program", "import subprocess", predict("subprocess.run(['true'])"), PARTS, "stopped"),
    (
        "leaves a daemon",
        "import os",
        predict("\n    if os.fork() == 0:\n        os.setsid()\n        while True: pass"),
        PARTS,
        "stopped",
    ),
    ("reads the environment", "import os", predict("os.environ['LABKIT_CANARY']"), PARTS, "KeyError"),
    ("becomes root", "import os", predict("os.setuid(0)"), PARTS, "stopped"),
    (
        "changes rights and times beside the grader",
        "import os",
        predict("os.utime(CANARY, (1, 1)); os.chmod(CANARY, 0)"),
        PARTS,
        "",
    ),
    ("names what is the grader's", "import os", predict("os.setxattr(CANARY, 'user.mine', b'1')"), PARTS, "stopped"),
    (
        "limits its parent",
        "import os, resource",
        predict("resource.prlimit(os.getppid(), resource.RLIMIT_CPU, (1, 1))"),
        PARTS,
        "stopped",
    ),
    (
        "slows its parent",
        "import os",
        predict("os.sched_setscheduler(os.getppid(), os.SCHED_IDLE, os.sched_param(0))"),
        PARTS,
        "stopped",
    ),
    (
        "has its parent told of a pipe",
        "import fcntl, os",
        predict("fcntl.fcntl(os.pipe()[0], fcntl.F_SETOWN, os.getppid())"),
        PARTS,
        "stopped",
    ),
    (
        "traces itself",
        "import ctypes",
        predict("\n    if ctypes.CDLL(None).ptrace(0, 0, 0, 0) < 0: raise OSError"),
        PARTS,
        "stopped",
    ),
    (
        "mounts",
        "import ctypes",
        predict("\n    if ctypes.CDLL(None).mount(b'/', b'/tmp', b'', 4096, 0) < 0: raise OSError"),
        PARTS,
        "stopped",
    ),
    # It forges.
    (
        "allclose is always true",
        "import numpy as np\nnp.allclose = np.array_equal = lambda *a, **k: True",
        NOTHING,
        BLIND,
        "changes nothing",
    ),
    (
        "everything is equal",
        "class E(float):\n    __eq__ = __ge__ = __le__ = lambda s, o: True\n    __lt__ = __gt__ = __ne__ = lambda s, o: False\n    __sub__ = __rsub__ = __abs__ = lambda s, *o: E(0)",
        update("self.xk_k = [E(0), E(0)]"),
        PARTS,
        "",
    ),
    (
        "an array that lies",
        "import numpy as np\nclass A(np.ndarray):\n    def __array_ufunc__(self, *a, **k): return np.zeros(2)",
        update("self.xk_k = np.zeros(2).view(A)"),
        PARTS,
        "",
    ),
    (
        "replaces replay",
        "import labkit.history\nlabkit.history.replay = lambda kf, log: None",
        "",
        frozenset({"parts", "check"}),
        "",
    ),
    (
        "replaces the comparison",
        "import labkit.checks.compare, labkit.checks\nlabkit.checks.compare.gap = labkit.checks.nearest = lambda *a: (0, None)\nlabkit.checks.decide = lambda *a: ([], [])",
        NOTHING,
        BLIND,
        "changes nothing",
    ),
    (
        "replaces check",
        "import labkit\nlabkit.check = check = lambda *a: print('passed')",
        NOTHING,
        BLIND,
        "changes nothing",
    ),
    (
        "answers with steps that hold nothing",
        "import labkit.instructor.sandbox.worker as w\nw._trace = lambda t: {'steps': [[] for _ in t.steps], 'stop': None, 'printed': ''}",
        NOTHING,
        None,
        "no answer to what was asked",
    ),
    (
        "answers with no steps",
        "import labkit.instructor.sandbox.worker as w\nw._trace = lambda t: {'steps': [], 'stop': None, 'printed': ''}",
        NOTHING,
        None,
        "no answer to what was asked",
    ),
    (
        "says passed on the channel",
        "import labkit.instructor.sandbox.wire as w\np = w.pack\nw.pack = lambda m: p({'status': 'passed', 'points': 99})",
        NOTHING,
        NONE,
        "",
    ),
    (
        "writes garbage on every channel",
        "import os",
        predict(
            "\n    for fd in range(3, 30):\n        try: os.write(fd, b'passed\\n' * 999)\n        except OSError: pass"
        ),
        PARTS,
        "no answer to what was asked",
    ),
    # Its worker says what was not asked for.
    (
        "answers with nests of lists",
        f"{WORKER}\nw.wire.pack = lambda m: b'\\0\\1\\xfb\\xd2\\0\\0\\0\\0[' + b'[],' * 43343 + b'[]]'",
        NOTHING,
        None,
        "no answer to what was asked",
    ),
    (
        "answers with a frame of 16 MB",
        f"{WORKER}\nw.wire.pack = lambda m: b'\\0\\xf4\\x24\\0\\0\\0\\0\\0' + b'[' * 16 * 10**6",
        NOTHING,
        None,
        "no answer to what was asked",
    ),
    (
        "long texts everywhere in an answer",
        f"{WORKER}\nlong = 'x' * 20000\n"
        "w.failure = lambda e: dict(raised=long, place=[long, 1], text=long, stopped=False)",
        predict("raise ValueError"),
        PARTS,
        "",
    ),
    (
        "answers byte by byte",
        f"{WORKER}\nimport os\ndef slow(m, pack=w.wire.pack):\n    for b in pack(m): os.write(4, bytes([b]))\n    return b''"
        "\nw.wire.pack = slow",
        NOTHING,
        None,
        "",
    ),
    (
        "answers before it is asked",
        "import os",
        predict("\n    for fd in range(3, 9):\n        try: os.write(fd, b'\\0' * 8)\n        except OSError: pass"),
        PARTS,
        "",
    ),
    ("closes its channel and goes on", "import os", predict("os.closerange(3, 99)\n    while True: pass"), PARTS, ""),
    (
        "prints 15 MB with an emoji",
        "",
        "old = KF.predict\ndef predict(self, u):\n    old(self, u)\n    print('x' * 15 * 10**6 + chr(128512))\nKF.predict = predict",
        None,
        "",
    ),
    ("a number of 5000 digits", "", update("self.xk_k = [10**5000, 0]"), PARTS, ""),
    ("a number of 100 digits in an error", "", predict("raise ValueError(10**100)"), PARTS, "ValueError"),
    ("an error without words", "", predict("raise ValueError"), PARTS, "ValueError"),
    ("an error of line ends", "", predict("raise ValueError('\\n\\n')"), PARTS, "ValueError"),
    (
        "an exception of its own root without words",
        "class E(BaseException): pass",
        predict("raise E('\\r')"),
        PARTS,
        "",
    ),
    ("kills itself", "import signal", predict("signal.raise_signal(9)"), PARTS, "SIGKILL"),
    (
        "kills its own thread",
        "import signal, threading",
        predict("signal.pthread_kill(threading.get_ident(), 9)"),
        PARTS,
        "SIGKILL",
    ),
    ("ends as if it had been killed", "import os", predict("os._exit(137)"), PARTS, "SIGKILL"),
    ("prints what a check prints", "", update("print('passed')"), BLIND, ""),
    (
        "patches print and pytest",
        "import builtins, sys\nbuiltins.print = lambda *a, **k: None\nsys.modules['pytest'] = sys.modules['nbval'] = sys",
        NOTHING,
        BLIND,
        "changes nothing",
    ),
    (
        "writes a report",
        "open('report.xml', 'w').write('<testsuite failures=\"0\"/>')",
        NOTHING,
        BLIND,
        "changes nothing",
    ),
    (
        "walks the stack",
        "import sys",
        update(
            "\n    f = sys._getframe()\n    while f:\n        self.xk_k = f.f_locals.get('right', self.xk_k)\n        f = f.f_back"
        ),
        BLIND,
        "",
    ),
    (
        "walks the garbage collector",
        "import gc",
        update(
            "\n    for o in gc.get_objects():\n        if isinstance(o, dict) and 'right' in o and 'make' in o: self.xk_k = o['right']"
        ),
        BLIND,
        "",
    ),
    (
        "a trace function",
        "import sys\nsys.settrace(lambda *a: None); sys.setprofile(lambda *a: None)",
        NOTHING,
        BLIND,
        "changes nothing",
    ),
    ("an import hook", "import sys\nsys.meta_path.insert(0, None)", NOTHING, BLIND, ""),
    ("an exit hook", "import atexit\natexit.register(lambda: print('passed'))", NOTHING, BLIND, "changes nothing"),
    ("an IPython hook", "get_ipython().events.register('pre_run_cell', print)", NOTHING, BLIND, "changes nothing"),
    (
        "looks the answers up",
        f"import json\nTABLE = json.loads({json.dumps(LOOKED_UP)!r})\ndef repeat_R(R, p): return TABLE[json.dumps([R.tolist(), p])]",
        "",
        frozenset({"stack", "blind"}),
        "",
    ),
    # Numbers that are none.
    ("NaN", "import numpy as np", update("self.xk_k = np.array([np.nan, 0])"), PARTS, "NaN"),
    ("infinity", "import numpy as np", update("self.Pk_k = np.full((2, 2), np.inf)"), PARTS, "NaN"),
    ("a column vector", "import numpy as np", predict("self.xk_k = np.zeros((2, 1))"), PARTS, "shape"),
    ("complex numbers", "", update("self.xk_k = self.xk_k + 1j"), BLIND, ""),
    ("an array of objects", "import numpy as np", update("self.xk_k = np.array([object(), None])"), PARTS, ""),
    ("text", "", update("self.xk_k = 'passed'"), PARTS, ""),
    ("None", "", update("self.xk_k = None"), PARTS, "None"),
    ("a generator", "", update("self.xk_k = (i for i in range(2))"), PARTS, ""),
    (
        "changes what it is given",
        "",
        "old = KF.update\ndef update(self, y):\n    old(self, y)\n    y.clear()\nKF.update = update",
        frozenset({"parts", "filter", "blind"}),
        "changes the list of landmarks",
    ),
    (
        "gives away its own array",
        "",
        "KF.xk_k = property(lambda s: s.__dict__['a'], lambda s, v: s.__dict__.setdefault('a', v.copy()).__setitem__(slice(None), v))",
        ALL,
        "",
    ),
    (
        "shares state between filters",
        "",
        "seen = []\nold = KF.predict\ndef predict(self, u):\n    seen.append(u)\n    old(self, u)\n    self.xk_k = self.xk_k + 0.1 * len(seen)\nKF.predict = predict",
        PARTS,
        "another result each time",
    ),
    (
        "draws random numbers",
        "import numpy as np",
        "old = KF.predict\ndef predict(self, u):\n    old(self, u)\n    self.xk_k = self.xk_k + 0.1 * np.random.randn(2)\nKF.predict = predict",
        PARTS,
        "another result each time",
    ),
    (
        "right at first, wrong later",
        "count = [0]",
        "old = KF.update\ndef update(self, y):\n    count[0] += 1\n    old(self, y)\n    if count[0] > 400: self.xk_k = self.xk_k + 1\nKF.update = update",
        None,
        "",
    ),
    # It wants to tell.
    ("tells hidden inputs in an error", "", predict("raise ValueError(f'TOLD {u} {self.map}')"), PARTS, ""),
    (
        "tells hidden inputs by an exception's name",
        "",
        predict("raise type('TOLD' + str(u[0]), (Exception,), {})()"),
        PARTS,
        "",
    ),
    (
        "tells later what it saw before",
        "seen = []\nold = stack\ndef stack(y, m, x):\n    seen.append(x)\n    return old(y, m, x)",
        "def init(self, *a, **k): raise ValueError(f'SEEN {len(seen)}')\nKF.__init__ = init",
        PARTS,
        "constructor",
    ),
    (
        "tells hidden inputs in the words of a check",
        "import labkit.checks as c\nsee, times = c.observe, [0]\ndef observe(data, subject):\n    times[0] += data['name'] == 'cartesian-kf'\n    if times[0] > 1: raise c.CheckError('x', f'TOLD {data}')\n    return see(data, subject)\nc.observe = observe",
        "",
        PARTS | {"filter", "blind"},
        "but not for other numbers",
    ),
    ("half an emoji in an error", "", predict("raise ValueError('\\ud83d')"), PARTS, ""),
    ("markup in an error", "", predict("raise ValueError('<script>alert(1)</script>')"), PARTS, "Not yet right"),
    ("an error of 10 MB", "", predict("raise ValueError('x' * 10**7)"), PARTS, "ValueError"),
    # Python that is none.
    ("no Python", "def (", "", PARTS, "is not there"),
    ("a null character", "x = '\0'", "", PARTS, "is not there"),
    ("tabs and spaces", "if True:\n\tx = 1\n        y = 2", "", PARTS, "is not there"),
    ("deletes the class", "", "del KF", ALL, ""),
    ("a function in place of the class", "", "def KF(*a, **k): return None", PARTS, ""),
    ("a number in place of the class", "", "KF = 7", PARTS, "class"),
    ("deletes numpy", "", "import sys\nsys.modules.clear()\nKF = KF", None, ""),
    ("coroutines", "", "async def update(self, y): pass\nKF.update = update", BLIND, ""),
]


def hand_in(folder, canary):
    """Write a notebook for each case into `folder`; canary: the folder that some of them reach for."""
    places = f"SOLUTION = {str(ROOT / 'solutions' / (LAB + '.py'))!r}\nCANARY = {str(canary)!r}\n"
    right = answers()["answer-kf"].replace("    def __init__", "    ready = READY\n\n    def __init__", 1)
    for name, before, after, *_ in CODE:
        book = filled(answer_kf=f"{needed(places + before)}\n\n{right}\n\n{after}\n")
        as_file(folder / re.sub(r"\W", "-", name) / f"{LAB}.ipynb", book)


def needed(code):
    """Code in one statement that the filter needs, so that it runs: of what nothing depends on, nothing does."""
    return f"if True:\n{textwrap.indent(code, '    ')}\n    READY = True"
