"""Taking in a downloaded data set: whole or not at all, whatever the download is."""

import os
import shutil
import stat
import subprocess
import sys
import time
import zipfile
from contextlib import suppress
from pathlib import Path

import pytest

from labkit import mrclam, recorded
from labkit.mrclam import example, install
from labkit.mrclam.files import FILES, set_number, verify
from labkit.recorded import DataError

from helpers.real_data import set7

NAME = "MRCLAM_Dataset7"


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A sound data set with the right name, small."""
    folder = tmp_path_factory.mktemp("good") / NAME
    folder.mkdir()
    return example.write(folder, seconds=20)


@pytest.fixture
def data(tmp_path, monkeypatch):
    """The data folder, which is not there yet."""
    monkeypatch.setenv("LABKIT_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


@pytest.fixture
def copy(good, tmp_path):
    return Path(shutil.copytree(good, tmp_path / "download" / NAME))


def zipped(path, source, top=NAME + "/", extra=()):
    """A zip of the files in `source` below `top`, and of `extra` (name or ZipInfo, content)."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(source.iterdir()):
            archive.write(file, top + file.name)
        for name, content in extra:
            archive.writestr(name, content)
    return path


def tree(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*"))


# ------------------------------------------------------------------------------------- where


def test_where_the_data_folder_is(tmp_path, monkeypatch):
    monkeypatch.setenv("LABKIT_DATA", "~/somewhere")
    assert install.folder() == Path.home() / "somewhere"
    monkeypatch.setenv("LABKIT_DATA", "")
    monkeypatch.setattr(recorded, "__file__", str(tmp_path / "project" / "labkit" / "recorded" / "__init__.py"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert install.folder() == tmp_path / "elsewhere" / "data"
    (tmp_path / "project" / "notebooks").mkdir(parents=True)
    assert install.folder() == tmp_path / "project" / "data"


def test_finding_a_set(data):
    assert install.find(NAME) is None
    (data / ".incoming-x" / NAME).mkdir(parents=True)  # what a killed copy leaves
    (data / "other").mkdir()
    assert install.find(NAME) is None
    (data / "mrclam" / NAME).mkdir(parents=True)
    assert install.find(NAME) == data / "mrclam" / NAME
    (data / NAME).mkdir()
    assert install.find(NAME) == data / NAME


@pytest.mark.parametrize(
    "name, number",
    [
        ("MRCLAM_Dataset7", 7),
        ("mrclam dataset 3 (1).zip", 3),
        ("MRCLAM9", 9),
        ("MRCLAM_Dataset12", None),
        ("data", None),
    ],
)
def test_the_number_in_a_name(name, number):
    assert set_number(name) == number


# ---------------------------------------------------------------------------------- taking in


def test_a_folder_is_taken_in(copy, data):
    (copy / "readme.txt").write_text("not part of the set")
    (report,) = install.take_in(copy)
    assert report.startswith(f"{NAME}: 5 robots, 15 landmarks, 0.2 minutes, ")
    assert report.endswith(f"verified; now in {data / NAME}")
    assert tree(data) == sorted([NAME, *(f"{NAME}/{name}" for name in FILES)])
    assert mrclam.load(1).name == "MRCLAM set 7, robot 1"


def test_a_parent_of_several_sets_is_taken_in_as_far_as_it_is_sound(copy, data):
    shutil.copytree(copy, copy.parent / "MRCLAM_Dataset2")
    (copy.parent / ".hidden").mkdir()
    assert len(install.take_in(copy.parent)) == 2
    assert sorted(p.name for p in data.iterdir()) == ["MRCLAM_Dataset2", NAME]
    shutil.rmtree(data)
    (copy / "Barcodes.dat").unlink()
    with pytest.raises(DataError) as error:
        install.take_in(copy.parent)
    assert "MRCLAM_Dataset2: 5 robots" in str(error.value) and "missing: Barcodes.dat" in str(error.value)
    assert [p.name for p in data.iterdir()] == ["MRCLAM_Dataset2"]


@pytest.mark.parametrize("top", [NAME + "/", "", "some/where/MRCLAM_Dataset7/", "data/"])
def test_a_zip_is_taken_in_with_a_top_folder_or_without(good, tmp_path, data, top):
    junk = [(f"__MACOSX/{NAME}/._Barcodes.dat", b"junk"), (f"__MACOSX/{NAME}/Barcodes.dat", b"junk"), ("a/b.m", b"%")]
    path = zipped(tmp_path / "MRCLAM_Dataset7 (1).zip", good, top, junk)
    (report,) = install.take_in(path)
    assert f"now in {data / NAME}" in report
    assert tree(data) == sorted([NAME, *(f"{NAME}/{name}" for name in FILES)])
    assert (data / NAME / "Barcodes.dat").read_bytes() == (good / "Barcodes.dat").read_bytes()


def test_a_set_whose_number_nothing_tells(good, tmp_path, data, capsys):
    path = zipped(tmp_path / "download.zip", good, top="")
    assert install.main([str(path)]) == 1
    said = capsys.readouterr().err
    assert "Which data set is in" in said and "rename it to MRCLAM_Dataset7" in said
    assert not data.exists()
    assert install.main([str(path.rename(tmp_path / "mrclam_dataset4.zip"))]) == 0
    assert install.find("MRCLAM_Dataset4")


def test_a_sound_copy_stays_and_a_spoilt_one_is_replaced(copy, data):
    install.take_in(copy)
    before = (data / NAME / "Barcodes.dat").stat().st_mtime_ns
    (copy / "Barcodes.dat").write_text("garbage")
    (report,) = install.take_in(copy)
    assert "already" in report and (data / NAME / "Barcodes.dat").stat().st_mtime_ns == before
    (data / NAME / "Robot1_Odometry.dat").unlink()
    with pytest.raises(DataError, match=r"Barcodes\.dat"):
        install.take_in(copy)
    assert (data / NAME / "Barcodes.dat").exists(), "a bad one replaces nothing"
    shutil.copy(data / NAME / "Barcodes.dat", copy)
    (report,) = install.take_in(copy)
    assert "now in" in report and verify(data / NAME)
    assert [p.name for p in data.iterdir()] == [NAME]


def test_a_set_one_folder_deeper_counts_as_there(copy, data):
    shutil.copytree(copy, data / "mrclam" / NAME)
    (report,) = install.take_in(copy)
    assert f"already in {data / 'mrclam' / NAME}" in report


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_interrupted_half_way_nothing_is_left(copy, data, monkeypatch, error):
    copied = []

    def stop(source, target):
        copied.append(target.write(source.read(100)))
        if len(copied) == 5:
            raise error

    monkeypatch.setattr(shutil, "copyfileobj", stop)
    with pytest.raises(KeyboardInterrupt if error is KeyboardInterrupt else install.DataMissingError):
        install.take_in(copy)
    assert install.find(NAME) is None and list(data.iterdir()) == []


def test_killed_half_way_nothing_counts_and_the_rest_is_swept_up_later(copy, data):
    script = (
        "import os, shutil, signal, sys; from labkit.mrclam import install\n"
        "shutil.copyfileobj = lambda s, t: os.kill(os.getpid(), signal.SIGKILL if os.name == 'posix' else 15)\n"
        "install.take_in(sys.argv[1])"
    )
    root = Path(install.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", script, str(copy)], cwd=root).returncode != 0
    (left,) = data.iterdir()
    assert (left / NAME).is_dir() and install.find(NAME) is None
    os.utime(left, (time.time() - 7200,) * 2)
    install.take_in(copy)
    assert [p.name for p in data.iterdir()] == [NAME]


# ---------------------------------------------------------------------------------- verifying


def cut(path):
    path.write_text(path.read_text()[:-9])


@pytest.mark.parametrize(
    "name, spoil, told",
    [
        ("Robot3_Odometry.dat", Path.unlink, "missing: Robot3_Odometry.dat"),
        ("Robot3_Odometry.dat", cut, "Robot3_Odometry.dat ends in the middle of a line"),
        ("Robot3_Odometry.dat", lambda p: p.write_text("# none\n"), "Robot3_Odometry.dat has no rows"),
        ("Robot3_Odometry.dat", lambda p: p.write_text("1.2e9 0 0\n1.1e9 0 0\n"), "times run backwards"),
        ("Robot3_Odometry.dat", lambda p: p.write_text("5 0 0\n6 0 0\n"), "robot 3 share no time"),
        (
            "Robot3_Odometry.dat",
            lambda p: p.write_text("5 0 0\n6 0\n7 0 0\n"),
            "Robot3_Odometry.dat: line 2 should be 3",
        ),
        ("Barcodes.dat", lambda p: p.write_text("<html>404</html>\n"), "Barcodes.dat: line 1 should be 2 numbers"),
        (
            "Robot1_Measurement.dat",
            lambda p: p.write_bytes(b"\xff\xfe\x00"),
            "Robot1_Measurement.dat is no text in UTF-8",
        ),
    ],
)
def test_what_is_wrong_is_said(copy, data, capsys, name, spoil, told):
    spoil(copy / name)
    assert install.main([str(copy)]) == 1
    said = capsys.readouterr().err
    assert told in said and "asrl.utias.utoronto.ca/datasets/mrclam" in said and "Leung" in said
    assert ".incoming" not in said, "the temporary folder is gone when this is read"
    assert list(data.iterdir()) == []


def test_all_faults_are_told_at_once_and_a_robot_that_saw_nothing_is_none(copy):
    (copy / "Robot2_Measurement.dat").write_text("")
    assert "verified" in verify(copy)
    (copy / "Barcodes.dat").unlink()
    cut(copy / "Robot5_Groundtruth.dat")
    with pytest.raises(
        DataError, match=r"(?s)missing: Barcodes.dat.*Robot5_Groundtruth|Robot5_Ground.*missing: Barcodes"
    ):
        verify(copy)


# ------------------------------------------------------------------------------ hostile archives


def link(target):
    entry = zipfile.ZipInfo(f"{NAME}/link")
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    return entry, target


@pytest.mark.parametrize(
    "extra, told",
    [
        (("../../outside.dat", b"x"), "leads out of its folder"),
        ((f"{NAME}/../../Barcodes.dat", b"x"), "leads out of its folder"),
        (("/etc/Barcodes.dat", b"x"), "leads out of its folder"),
        (("C:/Barcodes.dat", b"x"), "leads out of its folder"),
        (("..\\Barcodes.dat", b"x"), "leads out of its folder"),
        (link(b"/etc/passwd"), "is a link"),
        ((f"{NAME}//Barcodes.dat", b"x"), "is in it twice"),
        (("MRCLAM_Dataset8/Barcodes.dat", b"0" * (2**26 + 1)), "unpacks to 64 MB, far too much"),
    ],
)
def test_an_archive_that_plays_tricks_is_not_unpacked(good, tmp_path, data, capsys, extra, told):
    path = zipped(tmp_path / "MRCLAM_Dataset7.zip", good, extra=[extra])
    before = tree(tmp_path)
    assert install.main([str(path)]) == 2
    assert told in capsys.readouterr().err
    assert tree(tmp_path) == before


def test_an_archive_that_is_huge_protected_or_packed_strangely(good, tmp_path, data, monkeypatch):
    path = zipped(tmp_path / "MRCLAM_Dataset7.zip", good)
    whole = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(install, "LARGEST_ZIP", 1000)
        with pytest.raises(install.DataMissingError, match="far too much"):
            install.take_in(path)
    at = whole.index(b"PK\x01\x02")  # the first entry of the directory: flags at 8, way of packing at 10
    for offset, value, told in [(8, 1, "password"), (10, 14, "packed in a way that is not read here")]:
        path.write_bytes(whole[: at + offset] + bytes([value]) + whole[at + offset + 1 :])
        with pytest.raises(install.DataMissingError, match=told):
            install.take_in(path)
    assert not data.exists()


def test_a_damaged_archive_is_told_wherever_the_damage_is(good, tmp_path, data):
    path = zipped(tmp_path / "MRCLAM_Dataset7.zip", good)
    whole = path.read_bytes()
    steps = range(3, len(whole), len(whole) // 60)
    for at in [*steps, *range(len(whole) - 1200, len(whole), 17)]:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        with suppress(DataError):
            install.take_in(path)  # some bytes, like dates, do not matter
        assert not data.exists() or [p.name for p in data.iterdir()] in ([], [NAME])
        shutil.rmtree(data, ignore_errors=True)
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(install.DataMissingError, match="neither a folder nor a zip"):
        install.take_in(path)


def test_paths_that_lead_to_nothing(tmp_path, data, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("hello")
    zipped(tmp_path / "other.zip", tmp_path / "empty", extra=[("a.txt", b"hello")])
    for path, told in [
        ("nowhere", "There is nothing at"),
        ("notes.txt", "neither a folder nor a zip file"),
        ("empty", "has no MRCLAM data set"),
        ("other.zip", "has no MRCLAM data set"),
    ]:
        assert install.main([str(tmp_path / path)]) == 2
        said = capsys.readouterr().err
        assert told in said and str(tmp_path / path) in said and "asrl.utias.utoronto.ca" in said
    assert not data.exists()


# ------------------------------------------------------------------------------- command line


def test_the_command_line(copy, data, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab.py").touch()
    assert install.main([]) == 0
    assert "python3 lab.py data PATH" in capsys.readouterr().out
    (tmp_path / "lab.py").unlink()
    assert install.main([]) == 0
    said = capsys.readouterr().out
    assert str(data) in said and "no data set yet" in said and "labkit data PATH" in said
    assert install.main([str(copy), str(tmp_path / "nowhere")]) == 2
    said = capsys.readouterr()
    assert "verified" in said.out and "nothing at" in said.err
    assert install.main([]) == 0
    assert str(data / NAME) in capsys.readouterr().out


def test_the_real_set_is_taken_in(data, tmp_path):
    source = set7()
    with zipfile.ZipFile(tmp_path / "MRCLAM_Dataset7.zip", "w") as archive:
        for file in source.iterdir():
            archive.write(file, file.name)
    (report,) = install.take_in(tmp_path / "MRCLAM_Dataset7.zip")
    assert report.startswith("MRCLAM_Dataset7: 5 robots, 15 landmarks, 14.9 minutes, 20282 measurements, verified")
    assert mrclam.load(1).name == "MRCLAM set 7, robot 1"
