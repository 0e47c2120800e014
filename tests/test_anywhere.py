"""Without lab.py: the wheel in an environment of its own, in another folder, with the notebooks and nothing else."""

import re
import sys
import tarfile
import zipfile
from pathlib import Path

import nbformat
import pytest

from helpers.browser import LAB1, put, put_filled
from helpers.environments import Environment, build, run
from helpers.reference import COURSE, ci_only

pytestmark = ci_only
LAB2 = "02_noise_mismatch"


def setup(cell):
    return cell.id in ("kit", "setup")


@pytest.fixture(scope="module")
def dist(tmp_path_factory):
    return build(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def wheel(dist):
    return next(dist.glob("*.whl"))


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    return Environment(tmp_path_factory.mktemp("bare env") / "env", wheel, "ipykernel")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The notebooks filled in, and nothing else."""
    home = tmp_path_factory.mktemp("my course")
    for lab in COURSE:
        put_filled(home, lab)
    return home


def test_the_wheel_is_the_students_kit_and_the_source_distribution_all_of_it(dist, wheel, tmp_path):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        texts = [archive.read(name).decode("utf-8") for name in names if name.endswith((".py", ".json", ".toml"))]
    assert not [name for name in names if "instructor" in name or "solutions" in name or "tests" in name]
    assert not [text for text in texts if re.search(r"(?m)^ *### BEGIN (SOLUTION|HIDDEN)", text)]
    assert any(name.endswith("share/jupyter/lab/settings/overrides.json") for name in names)
    source = next(dist.glob("*.tar.gz"))
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", tmp_path, source)
    with zipfile.ZipFile(tmp_path / wheel.name) as archive:
        assert archive.namelist() == names
    with tarfile.open(source) as archive:
        held = {Path(*Path(name).parts[1:]).as_posix() for name in archive.getnames()}
    assert {"lab.py", f"solutions/{LAB1}.py", "labkit/instructor/__init__.py", "tests/test_anywhere.py"} <= held
    assert not [name for name in held if name.startswith((".venv", "data/", "dist/", ".git/"))]


def test_every_lab_runs_whole_and_passes_its_checks(bare, folder):
    for lab in COURSE:
        bare.execute(folder / f"{lab}.ipynb")
    said = run(bare.programs / "labkit", "check", *sorted(folder.glob("*.ipynb")), cwd=folder.parent)
    assert said.count("PASS") > 25 and "FAIL" not in said


def test_sliders_and_data_are_there(bare, folder):
    last = nbformat.v4.new_code_cell(
        "box = explore(KF)\nbefore = box.image.value\nbox.children[1].children[0].value = 10\n"
        "from labkit import mrclam\nprint(before != box.image.value, mrclam.load(robot=1).name)"
    )
    path = folder.parent / "sliders.ipynb"
    book = nbformat.read(folder / f"{LAB1}.ipynb", as_version=4)
    book.cells = [cell for cell in book.cells if setup(cell) or cell.id.startswith("answer")] + [last]
    nbformat.write(book, path)
    shown = bare.execute(path)[last.id]
    assert "True" in shown and "simulated" in shown


def test_colab_gets_the_kit_and_an_answer_that_is_pasted(wheel, tmp_path):
    """A notebook alone in its folder, and Colab's own IPython, kernel and widgets, which stay as they are."""
    own = ["ipython==7.34.0", "ipykernel==6.17.1", "ipywidgets==7.7.1"]
    colab = Environment(tmp_path / "colab", *own, "jedi<0.19", "numpy", "scipy", "matplotlib")
    before = set(run(colab.python, "-m", "pip", "freeze").splitlines())
    first = put_filled(tmp_path / "content", LAB1)
    shown = colab.execute(
        first, lambda cell: setup(cell) or re.match("answer|check|show-08", cell.id), LABKIT_FROM=str(wheel)
    )
    assert f"getting it from {wheel}" in shown["kit"] and "checks passed" in shown["check-kf"]
    assert "widget-view+json" in shown["show-08"] and "image/png" in shown["show-08"]
    added = set(run(colab.python, "-m", "pip", "freeze").splitlines()) - before
    assert {line.split("==")[0].split(" @")[0] for line in added} == {"filterpy", "robot-localization-labkit"}
    answers = [c.source for c in nbformat.read(first, 4).cells if c.id.startswith("answer") and c.cell_type == "code"]
    first.unlink()
    second = put(tmp_path / "content", LAB2)
    colab.execute(second, setup, first=["\n\n".join([f"%%writefile {LAB1}.py", *answers])])
