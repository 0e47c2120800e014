"""lab.py, the one thing a newcomer runs: on any Python, in any folder, with and without network.

Most tests run it in a copy of the project whose environment is real but holds stand-ins for pip,
pytest, JupyterLab and labkit, which report how they were called.
"""

import ast
import importlib.util
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import tomllib
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
NEEDS = ("requirements.txt", "tests/requirements.txt")
PROCESSES = str(min(os.cpu_count() or 1, 8) + 1)
posix = pytest.mark.skipif(os.name == "nt", reason="needs shell scripts or POSIX signals")

STAND_IN = """\
#!/usr/bin/env python3
import json, os, sys
call = {"argv": sys.argv, "cwd": os.getcwd(), "prefix": sys.prefix, "env": dict(os.environ)}
with open(os.path.join(sys.prefix, "calls"), "a") as file:
    file.write(json.dumps(call) + "\\n")
"""


class Project:
    """A copy of the project in a folder of the test's own."""

    def __init__(self, folder):
        self.folder = folder
        self.venv = folder / ".venv"
        for name in ("lab.py", "pyproject.toml", "LICENSE", *NEEDS):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
        shutil.copytree(ROOT / "labkit", folder / "labkit")
        (folder / "notebooks").mkdir()
        (folder / "notebooks/01_cartesian_ekf.ipynb").write_text(
            '{"cells": [], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}'
        )

    def start(self, *arguments, python=sys.executable, **variables):
        env = {**os.environ, **variables}
        if "LABKIT_VENV" not in variables:
            env.pop("LABKIT_VENV", None)
        return subprocess.Popen(
            [str(python), str(self.folder / "lab.py"), *arguments],
            env=env,
            cwd=self.folder.parent,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )

    def run(self, *arguments, **variables):
        """Run lab.py to its end; .stdout, .stderr and .returncode tell how it went."""
        process = self.start(*arguments, **variables)
        out, err = process.communicate()
        assert "Traceback" not in err, err
        return subprocess.CompletedProcess(arguments, process.returncode, out, err)

    def load(self):
        """lab.py of this copy as a module."""
        spec = importlib.util.spec_from_file_location("lab_of_copy", self.folder / "lab.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    def make_ready(self, needs=NEEDS):
        """An environment as a finished set-up leaves it, but for the packages."""
        base = getattr(sys, "_base_executable", sys.executable)
        subprocess.run([base, "-m", "venv", "--without-pip", self.venv], check=True)
        lab = self.load()
        lab.write_stamp({"place": lab.place(), **{name: lab.fingerprint(name) for name in needs}})
        return lab

    def stand_in(self, module, code=0):
        library = next(self.venv.rglob("site-packages"))
        (library / f"{module}.py").write_text(STAND_IN + f"sys.exit({code})\n")

    def calls(self):
        return [json.loads(line) for line in (self.venv / "calls").read_text().splitlines()]


def script(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def wait_for(act, seconds=600):
    """What act() returns, once it does so without an error; the end is for what never comes."""
    end = time.monotonic() + seconds
    while True:
        try:
            return act()
        except (OSError, ValueError):
            if time.monotonic() > end:
                raise
            time.sleep(0.05)


@pytest.fixture
def project(tmp_path, monkeypatch):
    monkeypatch.delenv("LABKIT_VENV", raising=False)
    return Project(tmp_path / "Kurs für Łukasz")


@pytest.fixture
def path_without_uv(tmp_path):
    """A search path with the system's programs but for uv, which a test adds as it likes."""
    folder = tmp_path / "programs"
    folder.mkdir()
    for name in ("env", "sh", "sleep"):
        if found := shutil.which(name):
            (folder / name).symlink_to(found)
    return folder


def old_python(version):
    """An interpreter of an old version, from the search path or pyenv, or None."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    for python in [shutil.which(f"python{version}"), *pyenv.glob(f"{version}.*/bin/python")]:
        if python and not subprocess.run([python, "-c", ""], capture_output=True).returncode:
            return python
    return None


# Pythons that are too old or too new ----------------------------------------------------------


@pytest.mark.parametrize("version", ["2.7", "3.6", "3.10"])
def test_an_old_python_says_so_in_one_line(project, path_without_uv, version):
    python = old_python(version)
    if not python:
        pytest.skip(f"no Python {version} here")
    done = project.run("setup", python=python, PATH=str(path_without_uv))
    assert done.returncode == 2
    assert f"needs Python 3.11 to 3.14, and this is {version} " in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not project.venv.exists()


def test_the_file_keeps_to_the_syntax_of_old_pythons():
    source = (ROOT / "lab.py").read_bytes().decode("ascii")  # Python 2 reads no other letters
    tree = ast.parse(source, feature_version=(3, 7))
    newer = (ast.JoinedStr, ast.AnnAssign, ast.AsyncFunctionDef, ast.NamedExpr, ast.Nonlocal)
    assert not [node for node in ast.walk(tree) if isinstance(node, newer)]
    assert not [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and (node.args.kwonlyargs or node.returns or any(a.annotation for a in node.args.args))
    ]


def test_a_python_that_is_too_new_says_so(project, monkeypatch):
    lab = project.load()
    monkeypatch.setattr(lab.sys, "version_info", (3, 15, 0))
    monkeypatch.setattr(lab.shutil, "which", lambda name: None)
    with pytest.raises(lab.SetUpError, match=r"needs Python 3\.11 to 3\.14, and this is 3\.15 "):
        lab.make_environment()


def test_uv_finds_another_python_where_this_one_does_not_fit(project, monkeypatch):
    lab = project.load()
    monkeypatch.setattr(lab.sys, "version_info", (3, 10, 0))
    monkeypatch.setattr(lab.shutil, "which", lambda name: "/bin/uv")
    commands = []
    monkeypatch.setattr(lab, "run", commands.append)
    lab.make_environment()
    assert [command[0] for command in commands] == ["/bin/uv"]
    assert ">=3.11,<3.15" in commands[0]


# What is run, and how -------------------------------------------------------------------------


def test_help_names_every_command(project):
    done = project.run("--help")
    assert done.returncode == 0 and not project.venv.exists()
    for word in ("setup", "test", "--quick", "check", "data", "build", "LABKIT_VENV"):
        assert word in done.stdout


@pytest.mark.parametrize(
    "arguments, module, passed_on",
    [
        pytest.param(["check", "my lab.ipynb"], None, ["check", "my lab.ipynb"], marks=posix),
        (
            ["test", "-k", "a b"],
            "pytest",
            ["-n", PROCESSES, "--dist", "loadfile", "--no-loadscope-reorder", "-p", "no:nbval", "-k", "a b"],
        ),
        (["test", "--quick", "-x"], "pytest", ["-m", "not slow and not browser", "-x"]),
        (["--no-browser", "--port=9"], "jupyterlab", ["--no-browser", "--port=9"]),
    ],
)
def test_commands_run_in_the_environment(project, arguments, module, passed_on):
    project.make_ready()
    if module:
        project.stand_in(module, code=7)
    else:
        script(project.venv / "bin/labkit", STAND_IN + "sys.exit(7)\n")
    done = project.run(
        *arguments,
        VIRTUAL_ENV="elsewhere",
        PYTHONPATH="elsewhere",
        CONDA_PREFIX="elsewhere",
        PYTHONHOME=sys.base_prefix,
        MPLBACKEND="elsewhere",
        PIP_TARGET="elsewhere",
    )
    assert done.returncode == 7, done.stderr
    (call,) = project.calls()
    assert call["argv"][-len(passed_on) :] == passed_on
    assert Path(call["prefix"]) == project.venv
    # Jupyter and pytest work on the project; labkit is given paths as seen from where one is.
    assert Path(call["cwd"]) == (project.folder if module else project.folder.parent)
    programs = call["env"]["PATH"].split(os.pathsep)[0]
    assert Path(programs).parent == project.venv
    assert call["env"]["VIRTUAL_ENV"] == str(project.venv)
    assert call["env"]["PYTHONUTF8"] == "1"
    assert call["env"]["PIP_USER"] == "0"  # with 1 in someone's settings, pip would refuse
    assert not {"PYTHONPATH", "PYTHONHOME", "CONDA_PREFIX", "MPLBACKEND"} & set(call["env"])


def test_jupyterlab_opens_the_first_lab(project):
    project.make_ready()
    project.stand_in("jupyterlab")
    for options in [], ["--LabApp.default_url=/lab"]:
        assert project.run(*options).returncode == 0
    first, other = [call["argv"] for call in project.calls()]
    assert "--LabApp.default_url=/lab/tree/notebooks/01_cartesian_ekf.ipynb" in first
    assert f"--ServerApp.root_dir={project.folder}" in first
    assert [o for o in other if "default_url" in o] == ["--LabApp.default_url=/lab"]
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    assert ("--allow-root" in first) == is_root


def test_windows_layout(project, monkeypatch):
    lab = project.load()
    assert Path(lab.program("uv", windows=True)) == project.venv / "Scripts" / "uv.exe"
    with monkeypatch.context() as patch:
        patch.setattr(lab.os, "name", "nt")  # where exec would not wait for the program
        assert lab.hand_over([sys.executable, "-c", "raise SystemExit(5)"]) == 5


@pytest.mark.parametrize(
    "arguments, told", [(["notebook"], "unknown command notebook"), (["setup", "now"], "unknown command setup now")]
)
def test_unknown_commands(project, arguments, told):
    done = project.run(*arguments)
    assert done.returncode == 2 and told in done.stderr and not project.venv.exists()


def test_a_missing_notebook_is_named_before_any_work(project):
    (project.folder / "notebooks/01_cartesian_ekf.ipynb").unlink()
    done = project.run()
    assert done.returncode == 2
    assert "notebooks/01_cartesian_ekf.ipynb is missing in" in done.stderr
    assert not project.venv.exists()
    (project.folder / "notebooks/03_range_bearing_ekf.ipynb").write_text("{}")  # as in a repository of one lab
    assert project.load().first_lab() == "notebooks/03_range_bearing_ekf.ipynb"


# When to install, when to start anew ----------------------------------------------------------


def change(name):
    return lambda project: (project.folder / name).open("a").write("\n")


def lose_python(project):
    shutil.rmtree(project.venv / ("Scripts" if os.name == "nt" else "bin"))


def move(project):
    project.folder = project.folder.rename(project.folder.with_name("moved"))
    project.venv = project.folder / ".venv"


def interrupt(project):
    (project.venv / "labkit.json").write_text("{}")


@pytest.mark.parametrize(
    "event, work",
    [
        (lambda project: None, []),
        (change("lab.py"), []),
        (change("requirements.txt"), ["install"]),
        (change("pyproject.toml"), ["install"]),
        (change("labkit/jupyter/overrides.json"), ["install"]),
        (interrupt, ["make", "install"]),
        (lose_python, ["make", "install"]),
        (move, ["make", "install"]),
        (lambda project: shutil.rmtree(project.venv), ["make", "install"]),
    ],
    ids=["nothing", "lab.py", "requirements", "pyproject", "overrides", "interrupted", "python", "moved", "gone"],
)
def test_only_what_is_needed_is_done(project, monkeypatch, event, work):
    project.make_ready()
    event(project)
    lab, done = project.load(), []
    monkeypatch.setattr(lab, "first_that_works", lambda ways: done.append("make"))
    monkeypatch.setattr(lab, "install", lambda needs: done.append("install"))
    lab.set_up("requirements.txt")
    assert done == work


def test_the_needs_of_the_tests_come_on_top(project, monkeypatch):
    lab = project.make_ready(needs=["requirements.txt"])
    done = []
    monkeypatch.setattr(lab, "install", done.append)
    for needs in ("requirements.txt", "tests/requirements.txt", "requirements.txt"):
        lab.set_up(needs)
    assert done == ["tests/requirements.txt"]


def test_run_inside_the_environment_it_builds_on_the_python_below(project):
    lab = project.make_ready()
    inside = lab.run([lab.program("python"), "-c", "import lab; print(lab.PYTHON)"]).strip()
    assert Path(inside).exists() and project.venv not in Path(inside).parents


def test_a_failed_installation_is_not_taken_for_done(project, monkeypatch):
    lab = project.make_ready()
    change("requirements.txt")(project)

    def fail(needs):
        raise lab.SetUpError("the disk is full")

    monkeypatch.setattr(lab, "install", fail)
    with pytest.raises(lab.SetUpError):
        lab.set_up("requirements.txt")
    assert lab.read_stamp() == {}


def test_a_folder_of_someone_else_is_spared(project, tmp_path):
    (tmp_path / "thesis.txt").write_text("three years")
    done = project.run("setup", LABKIT_VENV=str(tmp_path))
    assert done.returncode == 2 and "lab.py did not make" in done.stderr
    assert (tmp_path / "thesis.txt").read_text() == "three years"


# What goes wrong ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "output, told",
    [
        (
            "The virtual environment was not created successfully because ensurepip is not\n"
            "available.  On Debian/Ubuntu systems, you need to install the python3-venv\n",
            "sudo apt install python3-venv",
        ),
        ("/usr/bin/python3: No module named venv", "sudo apt install python3-venv"),
        ("ERROR: ... OSError: [Errno 28] No space left on device", "the disk is full"),
        ("error: failed to copy file: There is ... (os error 112)", "the disk is full"),
        ("[Errno 30] Read-only file system: '/media/course/.venv'", "LABKIT_VENV"),
        ("[WinError 5] Zugriff verweigert: 'C:\\\\Kurs\\\\.venv'", "LABKIT_VENV"),
        (
            "  cause: Failed to fetch: ...\n  cause: client error\n  cause: invalid peer certificate: UnknownIssuer",
            "certificate is not trusted",
        ),
        (
            "WARNING: Retrying (Retry(total=4)) after connection broken by 'SSLError("
            "SSLCertVerificationError(1, '[SSL: CERTIFICATE_VERIFY_FAILED]'))'",
            "certificate is not trusted",
        ),
        ("  cause: dns error\n  cause: failed to lookup address", "check the network"),
        (
            "WARNING: Retrying (Retry(total=4)) after connection broken by 'NewConnectionError("
            "'...: Failed to establish a new connection: [Errno 111] Connection refused')'",
            "check the network",
        ),
        ("line 1\n\nERROR: the moon is in the way", "ERROR: the moon is in the way"),
    ],
)
def test_the_cause_of_a_failure_is_told(project, output, told):
    assert told in project.load().explain("pip install", output)


@posix
def test_a_python_without_venv_names_the_package_to_install(project, path_without_uv, tmp_path, monkeypatch):
    lab = project.load()
    monkeypatch.setenv("PATH", str(path_without_uv))
    python = script(tmp_path / "python", "#!/bin/sh\necho 'ensurepip is not\navailable.'\nexit 1\n")
    monkeypatch.setattr(lab, "PYTHON", str(python))
    with pytest.raises(lab.SetUpError, match="sudo apt install python3-venv"):
        lab.set_up("requirements.txt")


@pytest.mark.slow
def test_without_network_one_line_says_so(project, tmp_path):
    nowhere = "http://127.0.0.1:9/simple"
    done = project.run(
        "setup",
        UV_DEFAULT_INDEX=nowhere,
        UV_INDEX_URL=nowhere,
        PIP_INDEX_URL=nowhere,
        UV_CACHE_DIR=str(tmp_path / "uv"),
        PIP_CACHE_DIR=str(tmp_path / "pip"),
        UV_HTTP_RETRIES="0",
        PIP_RETRIES="0",
        PIP_FIND_LINKS="",
        UV_FIND_LINKS="",
    )
    assert done.returncode == 2
    assert "the package index cannot be reached: check the network" in done.stderr
    assert json.loads((project.venv / "labkit.json").read_text()) == {}


@posix
@pytest.mark.parametrize("uv", ["broken", "missing"])
def test_pip_steps_in_for_uv(project, path_without_uv, uv):
    project.make_ready()
    project.stand_in("pip")
    change("requirements.txt")(project)
    if uv == "broken":
        script(path_without_uv / "uv", "#!/bin/sh\necho 'invalid peer certificate'\nexit 2\n")
    done = project.run("setup", PATH=str(path_without_uv))
    assert done.returncode == 0, done.stderr
    assert "trying another way" in done.stdout
    asked = [call["argv"][1:] for call in project.calls()]
    assert asked == [["install", "uv"]] * (uv == "missing") + [
        ["install", "--require-hashes", "-r", "requirements.txt"],
        ["install", "--no-deps", "--editable", "."],
    ]


@posix
def test_ctrl_c_ends_it_and_the_installer(project, path_without_uv):
    project.make_ready()
    change("requirements.txt")(project)
    script(path_without_uv / "uv", "#!/bin/sh\necho $$ > pid\nexec sleep 3600\n")
    process = project.start("setup", PATH=str(path_without_uv))
    pid = wait_for(lambda: int((project.folder / "pid").read_text()))
    process.send_signal(signal.SIGINT)
    err = process.communicate()[1]
    assert process.returncode == 130
    assert err == "lab.py: stopped; the same command goes on from here\n"
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


# The real thing -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A copy of the project, really set up."""
    project = Project(tmp_path_factory.mktemp("real") / "Kurs für Łukasz")
    done = project.run("setup")
    if "the package index cannot be reached" in done.stderr:
        pytest.skip("no package index can be reached from here")
    assert done.returncode == 0, done.stderr
    return project


@pytest.mark.slow
def test_a_real_set_up_is_complete(installed):
    overrides = installed.venv / "share/jupyter/lab/settings/overrides.json"
    assert overrides.read_text() == (ROOT / "labkit/jupyter/overrides.json").read_text()
    lab = installed.load()
    code = "import filterpy, labkit; print(labkit.__file__)"
    place = lab.run([lab.program("python"), "-c", code])
    assert Path(place.strip()) == installed.folder / "labkit/__init__.py"
    assert lab.run([lab.program("labkit"), "--version"]).startswith("labkit ")
    assert installed.run("setup").stdout == ""  # nothing left to do


@pytest.mark.slow
def test_jupyterlab_really_starts_with_the_course_settings(installed, tmp_path):
    own = {f"JUPYTER_{name}_DIR": str(tmp_path / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    process = installed.start("--no-browser", f"--port={port}", **own)
    try:
        for line in process.stderr:
            if found := re.search(r"(http://127\.\S+?)/lab/tree/(\S+)\?(token=\w+)", line):
                break
        address, notebook, token = found.groups()
        assert notebook == "notebooks/01_cartesian_ekf.ipynb"
        reply = wait_for(lambda: urllib.request.urlopen(f"{address}/lab/api/settings?{token}"))
        settings = {one["id"]: one["schema"] for one in json.load(reply)["settings"]}
    finally:
        process.terminate()
        process.communicate()
    for plugin, values in json.loads((ROOT / "labkit/jupyter/overrides.json").read_text()).items():
        for name, value in values.items():
            assert settings[plugin]["properties"][name]["default"] == value


# The files that say what is installed ---------------------------------------------------------


def pins(name):
    lines = (ROOT / name).read_text().splitlines()
    return {line.split(" \\")[0] for line in lines if line[0].isalnum()}


def test_requirements_are_pinned_hashed_and_of_no_particular_index():
    for name in NEEDS:
        text = (ROOT / name).read_text()
        assert all("==" in pin for pin in pins(name))
        assert "://" not in text and "find-links" not in text
        entries = re.findall(r"^\w.*?(?=^\w|\Z)", text, re.MULTILINE | re.DOTALL)
        assert len(entries) == len(pins(name)) and all("--hash=sha256:" in e for e in entries)


def test_all_lists_of_needs_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lab, tests = (pins(name) for name in NEEDS)
    assert {pin.partition(" ;")[0] for pin in lab} < {pin.partition(" ;")[0] for pin in tests}
    conda = (ROOT / "environment.yml").read_text()
    for need in [*project["dependencies"], *project["optional-dependencies"]["lab"]]:
        name = re.match(r"[\w-]+", need)[0]
        assert any(pin.startswith(f"{name}==") for pin in lab)
        assert re.search(rf"^  - {name}\b", conda, re.MULTILINE)
    extras = project["optional-dependencies"]
    for need in (need for extra in ("grading", "cluster", "test") for need in extras[extra] if "[" not in need):
        assert any(pin.startswith(re.match(r"[\w-]+", need)[0] + "==") for pin in tests)
