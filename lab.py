#!/usr/bin/env python3
"""The one thing to run: it sets the course up and opens it.

  python3 lab.py                        set up, then open JupyterLab on lab 1
  python3 lab.py setup                  set up only
  python3 lab.py check|data ...         run the labkit command (--help after it tells more)
  python3 lab.py --help                 show this text

Other options, such as --no-browser or --port=9000, go to JupyterLab.
The set-up makes an environment in the folder .venv beside this file, about 600 MB large;
the variable LABKIT_VENV names another folder for it.
"""

# Python 2.7 must be able to parse this file, to say that it is too old to run it.
from __future__ import print_function

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time

OLDEST, NEWEST = (3, 11), (3, 14)  # all of requirements.txt has wheels from the one to the other
# Running inside an environment that is to be made anew, the Python below it is the one that stays.
PYTHON = getattr(sys, "_base_executable", None) or sys.executable

HOME = os.path.dirname(os.path.realpath(__file__))
VENV = os.path.abspath(os.environ.get("LABKIT_VENV") or os.path.join(HOME, ".venv"))
STAMP = os.path.join(VENV, "labkit.json")

# The second is a superset of the first, with the same versions.
LAB_NEEDS, TEST_NEEDS = "requirements.txt", "tests/requirements.txt"
# Files that pip copies into the environment, so that a change in them calls for a new set-up.
COPIED = ("pyproject.toml", "labkit/jupyter/overrides.json")
# What instructors run, with what the tests need too: pytest and nbval mark the notebooks.
FULL = ("build", "export", "grade", "handout", "mark", "new", "release", "sandbox", "similar", "site", "term")
FULL_HELP = """\
  python3 lab.py test [ARGS]            run all tests; ARGS go to pytest
  python3 lab.py test --quick [ARGS]    run those that take a minute in all
  python3 lab.py grade|mark|similar|term|sandbox ...   the labkit command, for those who grade
  python3 lab.py release|handout|export|site|build|new ...   the same, for those who hand out
"""
# How long the tests take on two quiet cores [s, minutes], to be measured anew when they change much.
QUICK_TESTS, ALL_TESTS = 70, 15
FIRST_LAB = "notebooks/01_cartesian_ekf.ipynb"

# Each of these, set for another Python, would lead the environment's programs astray.
FOREIGN = (
    "CONDA_PREFIX",
    "MPLBACKEND",
    "PIP_PREFIX",
    "PIP_TARGET",
    "PYTHONHOME",
    "PYTHONPATH",
    "VIRTUAL_ENV",
    "__PYVENV_LAUNCHER__",
)

# What the reader is told, by what an installer or the system printed; numbers are in any language.
CAUSES = (
    (
        r"No space left|(errno|os error) 28\b|(winerror|os error) 112\b",
        "the disk is full: free 1 GB and run this again",
    ),
    (
        r"ensurepip is not|No module named '?(venv|ensurepip)",
        "this Python lacks its venv module: install it (on Debian and Ubuntu: sudo apt install"
        + " python3-venv) and run this again",
    ),
    (
        r"(errno|os error) (13|30)\b|(winerror|os error) (5|32)\b",
        "a file cannot be written: close the programs that use the environment, or let LABKIT_VENV"
        + " name a folder that can be written",
    ),
    (
        r"certificate|SSLError",
        "the package index's certificate is not trusted, mostly due to a proxy: ask those who run"
        + " your network, or use another one",
    ),
    (
        r"NewConnectionError|ConnectTimeout|ProxyError|Read timed out|Connection reset|dns error"
        + r"|error sending request|Failed to fetch|from versions: none",
        "the package index cannot be reached: check the network (and the proxy, if there is one)"
        + " and run this again",
    ),
)


class SetUpError(Exception):
    """Something that the person at the keyboard has to know, in one line."""


def say(text, stream=sys.stdout):
    stream.write("lab.py: %s\n" % text)
    stream.flush()


def program(name, windows=os.name == "nt"):
    """Where the environment has one of its programs."""
    return os.path.join(VENV, *(("Scripts", name + ".exe") if windows else ("bin", name)))


def environment():
    """The variables for all programs started here: the environment's own come first."""
    env = {name: value for name, value in os.environ.items() if name not in FOREIGN}
    path = os.path.dirname(program("python")) + os.pathsep + env.get("PATH", os.defpath)
    return dict(env, PATH=path, VIRTUAL_ENV=VENV, PYTHONUTF8="1", PIP_USER="0")


def explain(what, output):
    """One line on why something failed, and the words it said itself."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    for pattern, meaning in CAUSES:
        for line in lines:
            if re.search(pattern, line, re.IGNORECASE):
                return "%s\n  (%s)" % (meaning, line[:200])
    return "\n  ".join(["%s failed" % what] + lines[-12:])


def run(command):
    """Run an installer, quiet unless it takes long or fails."""
    start = time.time()
    try:
        process = subprocess.Popen(
            command,
            cwd=HOME,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        )
    except OSError as error:
        raise SetUpError(explain(command[0], str(error)))
    try:
        while True:
            try:
                output = process.communicate(timeout=15)[0]
                break
            except subprocess.TimeoutExpired:
                say("... still at it after %d s" % (time.time() - start))
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    if process.returncode:
        raise SetUpError(explain(" ".join(command), output))
    return output


def read_stamp():
    try:
        with open(STAMP) as file:
            return json.load(file)
    except (OSError, ValueError):
        return {}


def write_stamp(content):
    with open(STAMP, "w") as file:
        json.dump(content, file)


def fingerprint(needs):
    """What a set-up for these needs was made from."""
    digest = hashlib.sha256()
    for name in (needs,) + COPIED:
        with open(os.path.join(HOME, name), "rb") as file:
            digest.update(file.read())
    return digest.hexdigest()


def place():
    """What the environment's files refer to by name; a moved or broken environment differs."""
    try:
        version = run([program("python"), "-c", "import sys; print(sys.version_info[:2])"])
    except SetUpError:
        version = None
    return [HOME, VENV, version]


def clear_folder():
    """Make VENV an empty folder with a mark that lab.py made it; spare one without the mark."""
    if os.path.isdir(VENV):
        if os.listdir(VENV) and not os.path.exists(STAMP):
            raise SetUpError(
                "%s holds files that lab.py did not make: delete or rename it, or let"
                " LABKIT_VENV name another folder" % VENV
            )
        shutil.rmtree(VENV)
    os.makedirs(VENV)
    write_stamp({})


def first_that_works(ways):
    """Go one of several ways, each a list of commands; the last one's failure is the one told."""
    for way in ways:
        try:
            for command in way:
                run(command)
            return
        except SetUpError as problem:
            if way is ways[-1]:
                raise
            say("that failed (%s), trying another way" % str(problem).split(": ")[0])


def wrong_python():
    return (
        "the course needs Python %d.%d to %d.%d, and this is %d.%d (%s): run lab.py with one that"
        " fits, as in `python3.13 lab.py`, or install uv, which gets one"
    ) % (OLDEST + NEWEST + sys.version_info[:2] + (sys.executable,))


def make_environment():
    fits = OLDEST <= sys.version_info[:2] <= NEWEST
    uv = shutil.which("uv")
    ways = [[[PYTHON, "-m", "venv", VENV]]] if fits else []
    if uv:
        python = PYTHON if fits else ">=%d.%d,<%d.%d" % (OLDEST + (NEWEST[0], NEWEST[1] + 1))
        ways.append([[uv, "venv", "--seed", "--allow-existing", "--python", python, VENV]])
    if not ways:
        raise SetUpError(wrong_python())
    clear_folder()
    say("making the environment in %s" % VENV)
    first_that_works(ways)


def install(needs):
    """With uv, got by pip if need be, as it is several times as fast; with pip if that fails."""
    python = program("python")
    pip = [python, "-m", "pip", "install"]
    uv = shutil.which("uv", path=environment()["PATH"])
    # What is compiled now need not be at the first start of the lab, nor each time where nothing may be written.
    with_uv = [uv or program("uv"), "pip", "install", "--compile-bytecode", "--python", python]
    steps = (["--require-hashes", "-r", needs], ["--no-deps", "--editable", "."])
    first_that_works(
        [([] if uv else [pip + ["uv"]]) + [with_uv + step for step in steps], [pip + step for step in steps]]
    )


def set_up(needs):
    """Bring the environment to where these needs are installed; no work if they are."""
    start = time.time()
    here, stamp = place(), read_stamp()
    if stamp.get("place") == here and stamp.get(needs) == fingerprint(needs):
        return
    if stamp.get("place") != here:
        make_environment()
    write_stamp({})  # an interrupted installation is not to be built upon
    say("installing the packages; on a good network this takes 10 seconds to 2 minutes")
    install(needs)
    write_stamp(dict({name: fingerprint(name) for name in (LAB_NEEDS, needs)}, place=place()))
    say("ready after %d s" % (time.time() - start))


def hand_over(command, folder=None):
    """Let a program take lab.py's place: its signals and its exit code are the program's."""
    if folder:
        os.chdir(folder)
    if os.name != "nt":
        os.execve(command[0], command, environment())
    process = subprocess.Popen(command, env=environment())  # exec would not wait on Windows
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            pass  # the program gets it as well, and decides


def first_lab():
    """The first notebook that is there: some courses hand out a few labs only."""
    folder = os.path.join(HOME, "notebooks")
    names = sorted(name for name in os.listdir(folder) if name.endswith(".ipynb")) if os.path.isdir(folder) else []
    if not names:
        raise SetUpError("%s is missing in %s: get the project's files anew" % (FIRST_LAB, HOME))
    return "notebooks/" + names[0]


def open_jupyterlab(options):
    lab = first_lab()
    set_up(LAB_NEEDS)
    command = [program("python"), "-m", "jupyterlab", "--ServerApp.root_dir=" + HOME]
    if not any("default_url" in option for option in options):
        command.append("--LabApp.default_url=/lab/tree/" + lab)
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        command.append("--allow-root")
    say("starting JupyterLab; Ctrl-C twice ends it")
    return hand_over(command + options, HOME)


def test_processes():
    """One more than there are processors, since some tests wait; as a text."""
    return str(min(os.cpu_count() or 1, 8) + 1)


def run_tests(options):
    set_up(TEST_NEEDS)
    # Files stay together for the set-up that their tests share, and come in the order of tests/conftest.py. The
    # plugin of nbval takes 3 seconds to load, and only pytests that tests start need it.
    command = ["-n", test_processes(), "--dist", "loadfile", "--no-loadscope-reorder", "-p", "no:nbval"]
    if "--quick" in options:
        command += ["-m", "not slow and not browser"]
        options = [option for option in options if option != "--quick"]
        say("the quick tests take about %d s on two quiet cores" % QUICK_TESTS)
    elif not options:
        say("all tests take about %d minutes on two quiet cores" % ALL_TESTS)
    return hand_over([program("python"), "-m", "pytest"] + command + options, HOME)


def is_full_kit():
    return os.path.exists(os.path.join(HOME, TEST_NEEDS))


def help_text():
    last = "  python3 lab.py --help"
    return __doc__.strip().replace(last, (FULL_HELP if is_full_kit() else "") + last)


def main(arguments):
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a folder's name may not fit the terminal
    command, rest = (arguments or [""])[0], arguments[1:]
    if command in ("-h", "--help", "help"):
        print(help_text())
        return 0
    if sys.version_info < (3, 6):
        raise SetUpError(wrong_python())
    if command == "setup" and not rest:
        return set_up(LAB_NEEDS)
    if command in ("test",) + FULL and not is_full_kit():
        raise SetUpError("this is the students' kit: lab.py %s is in the full one" % command)
    if command == "test":
        return run_tests(rest)
    if command in ("check", "data") + FULL:
        set_up(TEST_NEEDS if command in FULL else LAB_NEEDS)
        return hand_over([program("labkit")] + arguments)
    if command and not command.startswith("-"):
        raise SetUpError("unknown command %s: see `python3 lab.py --help`" % " ".join(arguments))
    return open_jupyterlab(arguments)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except SetUpError as problem:
        say(problem, sys.stderr)
    except OSError as error:
        say(explain("lab.py", str(error)), sys.stderr)
    except KeyboardInterrupt:
        say("stopped; the same command goes on from here", sys.stderr)
        sys.exit(130)
    sys.exit(2)
