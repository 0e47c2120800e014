"""Runs as files: saved and loaded to the last bit, Freiburg's log localized on, and a sentence for each fault."""

import re
import shutil
from dataclasses import fields, replace

import numpy as np
import pytest

from labkit import Log, Map, load_answer, make_filter, metrics, mrclam, replay, wrap
from labkit.legged import LeggedRobot, Noise
from labkit.mrclam import example, install
from labkit.mrclam.files import FILES
from labkit.recorded import DataError
from labkit.team import of_logs
from labkit.world import Landmark

from helpers.reference import ROOT, record

KINDS = ("Odometry", "Groundtruth", "Measurement", "Barcodes", "Landmark_Groundtruth")


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    return example.write(tmp_path_factory.mktemp("published"), seconds=20)


@pytest.fixture
def data(tmp_path, monkeypatch):
    """The data folder, which is not there yet; its path has a space."""
    monkeypatch.setenv("LABKIT_DATA", str(tmp_path / "my data"))
    return tmp_path / "my data"


def same(a, b):
    """Whether two Logs are equal to the last bit, and of the same types."""
    for field in fields(Log):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if field.name == "map":
            assert x.ids == y.ids and x.positions.tobytes() == y.positions.tobytes()
        elif isinstance(x, np.ndarray):
            assert (x.dtype, x.shape) == (y.dtype, y.shape), field.name
            assert x.tolist() == y.tolist() if x.dtype == object else x.tobytes() == y.tobytes(), field.name
        else:
            assert x == y, field.name
    return True


# ------------------------------------------------------------------------------- the plain form


def named(log):
    """The same run with names, and numbers, for landmarks."""
    ids = {i: f"post {i}" if i % 2 else i for i in log.map.ids}
    seen = np.array([ids[i] for i in log.seen_id.tolist()], dtype=object)
    return replace(log, map=Map(Landmark(lm.p, ids[lm.id]) for lm in log.map), seen_id=seen)


def runs(published):
    wheels = mrclam.read(published, 2, robots=True)
    gaps = np.where(np.arange(len(wheels) + 1)[:, None] % 7 == 3, np.nan, wheels.truth)
    none = wheels.seen_step < 0
    blind = replace(wheels, seen=wheels.seen[none], seen_id=wheels.seen_id[none], seen_step=wheels.seen_step[none])
    return {
        "offsets in the world": record("xy"),
        "ranges in the world": record("rb").seen_by("rb", np.eye(2) / 3, rng=3),
        "wheels, that see robots too": wheels,
        "legs": mrclam.with_odometry(wheels),
        "legs and a compass": replace(mrclam.with_odometry(wheels), frame="world"),
        "truth with gaps": replace(wheels, truth=gaps),
        "no truth": replace(wheels, truth=None, name="Grünau, «dritte» Fahrt\nof 7"),
        "names": named(record("rb")),
        "saw nothing": blind,
    }


def test_what_is_saved_is_loaded_to_the_last_bit(published, tmp_path):
    for name, log in runs(published).items():
        place = log.save(tmp_path / "far" / name)
        assert same(log, Log.load(place)), name
        assert [p.name for p in place.parent.iterdir() if p.name.startswith(".")] == []


def test_a_teams_run_is_saved_as_its_members_runs(published, tmp_path):
    team = of_logs([mrclam.with_odometry(mrclam.read(published, r, robots=True)) for r in (1, 2, 3)])
    places = [log.save(tmp_path / f"robot {i}") for i, log in zip(team.ids, team.logs)]
    again = of_logs([Log.load(place) for place in places])
    assert all(same(a, b) for a, b in zip(team.logs, again.logs))


def test_what_cannot_be_saved_is_told_and_nothing_is_lost(tmp_path):
    log = record()
    with pytest.raises(ValueError, match="FieldLog has more than the plain form holds"):
        LeggedRobot(rng=1).record(5).save(tmp_path / "legs")
    with pytest.raises(ValueError, match="whole number or a name"):
        replace(log, map=Map([Landmark((1, 2), (3, 4))])).save(tmp_path / "ids")
    with pytest.raises(ValueError, match="whole number or a name"):
        replace(log, map=Map([Landmark((1, 2), "7")])).save(tmp_path / "ids")
    with pytest.raises(ValueError, match="controls two or three"):
        replace(log, controls=log.controls[:, :1]).save(tmp_path / "ids")
    turning = replace(log, truth=np.column_stack([log.truth, 0.08 * np.arange(len(log) + 1)]))
    with pytest.raises(
        ValueError, match=r"not saved: on.truth.csv, line 81: heading \[rad\] is 6.32: is it in deg\?.*wrap"
    ):
        turning.save(tmp_path / "on")
    (tmp_path / "mine").mkdir()
    with pytest.raises(ValueError, match="name a new folder, so that nothing is lost"):
        log.save(tmp_path / "mine")
    assert [p.name for p in tmp_path.iterdir()] == ["mine"]


PLAIN = {
    "steps.csv": "start [s],end [s],forward [m/s],turn rate [rad/s]\n0,0.5,0.2,0\n0.5,1,0.2,0.1\n1,1.5,0.2,0.1\n",
    "measurements.csv": "time [s],id,range [m],bearing [rad]\n0.5,3,2.1,0.4\n1.2,door,3.5,-1.2\n",
    "landmarks.csv": "id,x [m],y [m]\n3,2,1\ndoor,-1.5,4\n",
    "truth.csv": "time [s],x [m],y [m],heading [rad]\n0,0,0,0\n0.5,0.1,0,0\n1,,,\n1.5,0.3,0.02,0.1\n",
}


@pytest.fixture
def plain(tmp_path):
    """Write a small run with some of its files changed: {file: (old, new)}; the folder."""

    def make(**changes):
        for name, text in PLAIN.items():
            old, new = changes.get(name.removesuffix(".csv"), ("", ""))
            assert old in text
            (tmp_path / name).write_text(text.replace(old, new, 1), encoding="utf-8")
        return tmp_path

    return make


def test_a_lecturers_own_files_in_their_own_units(plain):
    log = Log.load(plain())
    assert (len(log), log.frame, log.sensor, log.map.ids) == (3, "robot", "rb", [3, "door"])
    assert log.seen_step.tolist() == [0, 1] and log.seen_id.tolist() == [3, "door"]
    assert np.isnan(log.truth[2]).all() and log.truth[3].tolist() == [0.3, 0.02, 0.1]
    again = Log.load(
        plain(
            landmarks=(
                PLAIN["landmarks.csv"],
                "\ufeffID ; note; Y [cm] ; x [mm]\r\n\r\n3;oak;100;2000,0\r\ndoor;;400;-1500\r\n",
            ),
            measurements=("bearing [rad]\n0.5,3,2.1,0.4", f"bearing [deg]\n0.5,3,2.1,{np.rad2deg(0.4)}"),
            steps=(
                PLAIN["steps.csv"],
                "end [ms],start [ms],turn rate [rad/s],forward [cm/s]\n500,0,0,20\n1000,500,.1,20\n1500,1000,.1,20",
            ),
        )
    )
    for name in ("times", "controls"):
        np.testing.assert_allclose(getattr(log, name), getattr(again, name), atol=1e-15)
    np.testing.assert_allclose(log.seen[0], again.seen[0])
    np.testing.assert_allclose(log.map.positions, again.map.positions)


def test_turns_in_degrees_and_times_that_shrink_are_noticed(plain):
    headings = "time [s],x [m],y [m],heading [rad]\n0,0,0,0\n0.5,0,0,0\n1,0,0,0.05\n1.5,0,0,0.1\n"
    truth, steps = (PLAIN["truth.csv"], headings), PLAIN["steps.csv"].replace("0.2,0.1", "0.2,5.7")
    assert len(Log.load(plain(truth=truth))) == 3
    with pytest.raises(DataError, match=r"steps.csv, line 1: by turn rate .* 5.7 rad in all, .* by 0.1: is it in deg"):
        Log.load(plain(truth=truth, steps=(PLAIN["steps.csv"], steps)))
    legs = "start [s],end [s],ahead [m],left [m],turned [rad]\n0,0.5,0.1,0,0\n0.5,1,0.1,0,5.7\n1,1.5,0.1,0,0\n"
    with pytest.raises(
        DataError, match=r"line 3: turned \[rad\] is 5.7 in one step, half a turn is 3.14: in \[deg\]\?"
    ):
        Log.load(plain(steps=(PLAIN["steps.csv"], legs)))
    assert not any("first step" in note for note in Log.load(plain()).notes)
    seen = "time [ms],id,range [m],bearing [rad]\n0.5,3,2.1,0.4\n1.0,3,2.1,0.4\n1.2,3,2.1,0.4\n"
    assert (
        "in the unit that the header says" in Log.load(plain(measurements=(PLAIN["measurements.csv"], seen))).notes[-1]
    )


def test_truth_with_times_of_its_own_is_interpolated_the_short_way_round(plain):
    t = np.arange(0, 1.6, 0.06)
    rows = "\n".join(f"{a},{a},0,{wrap(3 + 0.2 * a)}" for a in t)
    log = Log.load(plain(truth=(PLAIN["truth.csv"], f"time [s],x [m],y [m],heading [rad]\n{rows}")))
    np.testing.assert_allclose(log.truth, [(a, 0, wrap(3 + 0.2 * a)) for a in log.times], atol=1e-12)
    assert "interpolated, unknown at 0 of 4" in log.notes[0]
    (plain() / "truth.csv").write_text("time [s],x [m],y [m]\n9,1,1\n10,1,2\n")
    with pytest.raises(DataError, match=r"knows nothing of the run, .*: is it of another clock"):
        Log.load(plain(truth=(PLAIN["truth.csv"], "time [s],x [m],y [m]\n9,1,1\n10,1,2\n")))


@pytest.mark.parametrize(
    "file, old, new, told",
    [
        ("steps", "forward", "speed", r"steps.csv, line 1: this line should name the columns"),
        ("steps", PLAIN["steps.csv"], "", r"steps.csv, line 1: this line should name the columns"),
        ("steps", "[m/s]", "[mph]", r"line 1: the column 'forward \[mph\]' must have one of the units \[m/s\], "),
        ("steps", "0,0.5,0.2,0", "0,0.5,x,0", r"line 2: forward \[m/s\] must be a finite number, but it is 'x'"),
        ("steps", "0,0.5,0.2,0", "0,0.5", r"line 2: forward \[m/s\] must be a finite number, but it is ''"),
        ("steps", "1,0.2,0.1", "1,0.2,12.9", r"line 3: turn rate \[rad/s\] is 12.9: is it in deg/s\? Then say so"),
        ("steps", "1,0.2,0.1", "1,200,0.1", r"line 3: forward \[m/s\] is 200: is it in mm/s\?"),
        ("steps", "0.5,1,", "1,0.5,", r"line 3: end \[s\] is 0.5, which is not after start \[s\], 1"),
        ("steps", "0.5,1,", "0.7,1,", r"line 3: start \[s\] is 0.7, but a step must start when"),
        ("measurements", "3,2.1,0.4", "4,2.1,0.4", r"measurements.csv, line 2: there is no landmark 4 in landmarks"),
        ("measurements", "3,2.1,0.4", "3,2.1,23", r"line 2: bearing \[rad\] is 23: is it in deg\? Then say so"),
        ("measurements", "2.1", "2100", r"line 2: range \[m\] is 2100, but landmarks.csv has .* in \[mm\]\?"),
        ("measurements", "2.1", "-1", r"line 2: range \[m\] is -1: does the sensor say so that it saw nothing\?"),
        ("measurements", "1.2,", "0.2,", r"line 3: time \[s\] is 0.2, which is before that of the line above"),
        ("measurements", "1.2,", "1790000001.2,", r"line 3: time \[s\] is 1790000001.2, but the run lasts"),
        ("landmarks", "door,-1.5,4", "3,-1.5,4", r"landmarks.csv, line 3: the id 3 is here for the second time"),
        ("landmarks", "door,-1.5", ",-1.5", r"landmarks.csv, line 3: the id is missing"),
        ("landmarks", "3,2,1\ndoor,-1.5,4", "3,2000,1000\ndoor,-1500,4000", r"landmarks .* apart: in \[mm\]\?"),
        ("landmarks", "2,1", "2,", r"landmarks.csv, line 2: a landmark's place must be known"),
        ("truth", "0.5,0.1", "0,0.1", r"truth.csv, line 3: time \[s\] is 0, which is not after"),
        ("truth", "0.5,0.1", "\0,0.1", r"truth.csv, line 3: "),
        ("truth", "0.02,0.1", "0.02,57", r"truth.csv, line 5: heading \[rad\] is 57: is it in deg\?"),
    ],
)  # fmt: skip
def test_each_fault_has_its_sentence_with_file_and_line(plain, file, old, new, told):
    with pytest.raises(DataError, match=told):
        Log.load(plain(**{file: (old, new)}))


@pytest.mark.parametrize(
    "about, told",
    [
        ("{", r"about.json, line 1: this is no JSON"),
        (f'{{"range": {"9" * 5000}}}', r"about.json, line 1: this is no JSON"),
        ("[]", r"about.json must have its keys in braces"),
        ('{"range": -1}', r"about.json: range must be a number of metres above 0, but it is -1"),
        ('{"Frame": "robot"}', r"about.json has 'Frame', but"),
        ('{"frame": "world"}', r"with such steps frame is 'robot', not 'world'"),
        ('{"Q": "small"}', r"about.json: Q must be"),
        ('{"range": "3 m"}', r"about.json: range must be"),
        ('{"notes": 7}', r"about.json: notes must be"),
    ],
)
def test_a_wrong_about_json_is_told(plain, about, told):
    (plain() / "about.json").write_text(about)
    with pytest.raises(DataError, match=told):
        Log.load(plain())


def test_no_folder_a_file_that_lacks_and_one_that_is_no_text(plain, tmp_path, data):
    with pytest.raises(DataError, match=r"There is no folder nowhere, neither here nor in .*my data"):
        Log.load("nowhere")
    (plain() / "steps.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match=r"steps.csv is no text in UTF-8: save it"):
        Log.load(tmp_path)
    (tmp_path / "steps.csv").unlink()
    with pytest.raises(DataError, match="lacks steps"):
        Log.load(tmp_path)


# ------------------------------------------------------------------------------------ Freiburg


def freiburg(folder, steps=200, seed=5):
    """Write a run as that course's simulator does: turn, go, turn, then look; the true poses (steps+1, 3)."""
    rng = np.random.default_rng(seed)
    world = rng.uniform([-1, -1], [11, 10], (9, 2))
    pose, poses, lines = np.zeros(3), [np.zeros(3)], []
    for k in range(steps):
        r1, t, r2 = 0.1 * np.sin(k / 9), 0.1, 0.03 + 0.02 * np.cos(k / 5)
        pose = pose + [t * np.cos(pose[2] + r1), t * np.sin(pose[2] + r1), r1 + r2]
        poses.append(pose)
        told = np.array([r1, t, r2]) * (1 + 0.1 * rng.standard_normal(3)) + 0.003 * rng.standard_normal(3)
        lines.append("ODOMETRY " + " ".join(map(str, told)))
        for i, d in enumerate(world - pose[:2], 1):
            if np.hypot(*d) < 5:
                z = np.hypot(*d), wrap(np.arctan2(d[1], d[0]) - pose[2])
                z += rng.normal(0, (0.1, 0.05))
                lines.append(f"SENSOR {i} {z[0]} {z[1]}")
    (folder / "world.dat").write_text("".join(f"{i} {x} {y}\n" for i, (x, y) in enumerate(world, 1)))
    (folder / "sensor_data.dat").write_bytes("\r\n".join(lines).encode())
    poses = np.array(poses)
    poses[:, 2] = wrap(poses[:, 2])
    return poses


def test_lab_4s_filter_localizes_on_a_log_of_freiburgs_course(tmp_path):
    truth = freiburg(tmp_path)
    log = Log.load(tmp_path)
    assert (len(log), log.frame, log.sensor, log.truth) == (200, "robot", "rb", None)
    EKF = load_answer("04_legged_robot", "EKF", ROOT / "solutions")
    noise = Noise(odometry=0.1, slip=0.003, spin=0.01, range_floor=0.1, bearing=0.05)
    start = truth[0] + [0.3, -0.3, 0.1]
    h = replay(make_filter(EKF, log, x0=start, P0=np.diag([0.3, 0.3, 0.1]) ** 2, noise=noise), log)
    error = np.hypot(*(h.x - truth)[:, :2].T)
    reckoned = [start]
    for ahead, left, turned in log.controls:
        x, y, a = reckoned[-1]
        c, s = np.cos(a), np.sin(a)
        reckoned.append([x + c * ahead - s * left, y + s * ahead + c * left, a + turned])
    drift = np.hypot(*(np.array(reckoned) - truth)[:, :2].T)
    assert np.sqrt(np.mean(error[50:] ** 2)) < 0.1 < 0.3 < drift[50:].max()
    assert same(log, Log.load(log.save(tmp_path / "plain")))


@pytest.mark.parametrize(
    "world, sensor, told",
    [
        ("1 2\n", "ODOMETRY 0 1 0\n", r"world.dat, line 1: it should be id x y, but it is '1 2'"),
        ("1 2 1\n1 3 4\n", "ODOMETRY 0 1 0\n", r"world.dat, line 2: the id 1 is here for the second time"),
        (
            "1 2 1\n",
            "ODOMETRY 0 1\n",
            r"sensor_data.dat, line 1: it should be ODOMETRY r1 t r2 or SENSOR id range bearing",
        ),
        ("1 2 1\n", "ODOMETRY 0 1 0\nSENSOR 2 1 0\n", r"sensor_data.dat, line 2: there is no landmark 2 in world.dat"),
        ("1 2 1\n", "SENSOR 1 1 0\nODOMETRY 0 1 0\n", r"sensor_data.dat, line 1: a line SENSOR before the first"),
        ("1 2 1\n", "ODOMETRY 0 1 0\nSENSOR 1 1 45\n", r"sensor_data.dat, line 2: bearing is 45, more than a turn"),
        ("1 2 1\n", "ODOMETRY 0 1 0\nSENSOR 1.5 1 1\n", r"sensor_data.dat, line 2: an id must be a whole number"),
        ("1 2 1\n", "ODOMETRY 0 1 0\nSENSOR 1 0 1\n", r"sensor_data.dat, line 2: range \[m\] is 0: does"),
        ("1 2 1\n", "\n", r"sensor_data.dat has no line ODOMETRY"),
        (None, "ODOMETRY 0 1 0\n", r"lacks world.dat"),
    ],
)
def test_what_is_wrong_with_freiburgs_files_is_told(tmp_path, world, sensor, told):
    if world:
        (tmp_path / "world.dat").write_text(world)
    (tmp_path / "sensor_data.dat").write_text(sensor)
    with pytest.raises(DataError, match=told):
        Log.load(tmp_path)


# ----------------------------------------------------------------------- courses' copies of MRCLAM

HEADERS = {  # as found in courses' copies; the last has none
    "words": {
        "Odometry": "time,forward_velocity,angular_velocity",
        "Groundtruth": "time,x,y,orientation",
        "Measurement": "time,subject_nb,range,bearing",
        "Barcodes": "subject_nb,barcode_nb",
        "Landmark_Groundtruth": "subject_nb,x,y,x_std_dev,y_std_dev",
    },
    "a comment": dict.fromkeys(KINDS, "# Time [s]    Subject #    x [m] ,,,,"),
    "none": dict.fromkeys(KINDS),
}
HEADERS["pandas"] = {kind: f",{words}" for kind, words in HEADERS["words"].items()}


def copied(published, place, header=None, robot=1, name="{}.csv", comma=",", end="\n"):
    """A course's copy of one robot's files."""
    place.mkdir(exist_ok=True)
    for kind in KINDS:
        source = f"Robot{robot}_{kind}.dat" if f"Robot1_{kind}.dat" in FILES else f"{kind}.dat"
        lines = [comma.join(line.split()) for line in (published / source).read_text().splitlines() if line[0] != "#"]
        if header is HEADERS["pandas"]:
            lines = [f"{k},{line}" for k, line in enumerate(lines)]
        first = [header[kind]] if header and header[kind] else []
        (place / name.format(kind)).write_bytes(end.join([*first, *lines]).encode())
    return place


@pytest.mark.parametrize(
    "header, name, comma, end",
    [
        ("words", "{}.csv", ",", "\r\n"),
        ("words", "Cleaned_{}.csv", ", ", "\n"),
        ("pandas", "{}.csv", ",", "\n"),
        ("a comment", "Robot1_{}.csv", ",", "\n"),
        ("none", "ds1_{}.dat", "\t", "\n"),
        ("none", "{}.TXT", ";", "\n"),
    ],
)
def test_a_courses_copy_is_read_like_the_published_files(published, tmp_path, header, name, comma, end):
    copy = copied(published, tmp_path / "a course", HEADERS[header], name=name, comma=comma, end=end)
    assert same(replace(mrclam.read(published), name="a course, robot 1"), mrclam.read(copy))


def test_a_copy_with_subjects_for_barcodes_and_three_columns_of_landmarks(published, tmp_path):
    copy = copied(published, tmp_path / "copy", HEADERS["words"])
    codes = {c: s for s, c in (line.split(",") for line in (copy / "Barcodes.csv").read_text().splitlines()[1:])}
    head, *rows = [line.split(",") for line in (copy / "Measurement.csv").read_text().splitlines()]
    rows = [[t, codes.get(c, c), *z] for t, c, *z in rows]
    (copy / "Measurement.csv").write_text("\n".join(map(",".join, [head, *rows])))
    rows = [line.split(",")[:3] for line in (copy / "Landmark_Groundtruth.csv").read_text().splitlines()]
    (copy / "Landmark_Groundtruth.csv").write_text("\n".join(map(",".join, rows)))
    log, due = mrclam.read(copy), mrclam.read(published)
    assert "the measurements have subjects in place of barcodes" in log.notes
    assert same(replace(log, name="", notes=()), replace(due, name="", notes=()))


@pytest.mark.parametrize(
    "kind, old, new, told",
    [
        ("Measurement", "bearing", "bearing_deg", r"Measurement.csv: line 1 has a column in deg; those of MRCLAM are"),
        ("Odometry", "0.120000,", "0.0,0.0,", r"Odometry.csv: line \d+ should be 3 numbers"),
        ("Odometry", "0.120000,", "fast,", r"Odometry.csv: line \d+ should be 3 numbers"),
    ],
)
def test_what_is_wrong_with_a_copy_is_told(published, tmp_path, kind, old, new, told):
    copy = copied(published, tmp_path / "copy", HEADERS["words"])
    text = (copy / f"{kind}.csv").read_text()
    assert old in text
    (copy / f"{kind}.csv").write_text(text.replace(old, new, 1))
    with pytest.raises(DataError, match=told):
        mrclam.read(copy)


# ------------------------------------------------------------------------------- labkit data PATH


def said_by(capsys, *paths):
    code = install.main([str(path) for path in paths])
    said = capsys.readouterr()
    return code, said.out + said.err


def test_labkit_data_takes_each_form_in_and_says_how_it_is_loaded(published, tmp_path, data, capsys):
    copy = copied(published, tmp_path / "a course", HEADERS["words"])
    (tmp_path / "data").mkdir()
    freiburg(tmp_path / "data", steps=20)
    shutil.make_archive(str(tmp_path / "freiburg"), "zip", tmp_path, "data")
    own = record("rb").save(tmp_path / "our robot")
    code, said = said_by(capsys, copy, tmp_path / "freiburg.zip", own)
    assert code == 0, said
    assert "a course: a course's copy of MRCLAM, 140 steps in 14 s, 15 landmarks" in said
    assert "freiburg: the log of Freiburg's course, 20 steps" in said and "note: no clock in the log" in said
    assert "our robot: a run in the plain form, 160 steps" in said and str(data / "our robot") in said
    for name, due in {
        "a course": mrclam.read(copy),
        "freiburg": replace(Log.load(tmp_path / "data"), name="freiburg"),
        "our robot": record("rb"),
    }.items():
        assert f"log = Log.load({name!r})" in said
        assert same(due, Log.load(name))
    code, said = said_by(capsys, copy)
    assert code == 0 and "was already in" in said
    code, said = said_by(capsys)
    assert str(data / "a course") in said and "no data set yet" not in said


def test_labkit_data_makes_a_whole_set_of_a_copy_with_all_five_robots(published, tmp_path, data, capsys):
    place = tmp_path / "MRCLAM_Dataset7"
    for robot in range(1, 6):
        copied(published, place, HEADERS["words"], robot, f"Robot{robot}_{{}}.csv")
    for kind in ("Barcodes", "Landmark_Groundtruth"):
        for robot in range(1, 6):
            (place / f"Robot{robot}_{kind}.csv").replace(place / f"{kind}.csv")
    code, said = said_by(capsys, place)
    assert code == 0 and "MRCLAM_Dataset7: 5 robots, 15 landmarks" in said
    assert same(replace(mrclam.read(published, 3), name="MRCLAM set 7, robot 3"), mrclam.load(3))
    for path in place.glob("Robot5_*"):
        path.unlink()
    code, said = said_by(capsys, place)
    assert code == 0 and "log = Log.load('MRCLAM_Dataset7 run robot 4')" in said


def test_labkit_data_tells_what_is_wrong_and_takes_nothing_in(published, tmp_path, data, capsys):
    copy = copied(published, tmp_path / "a course", HEADERS["words"])
    (copy / "Barcodes.csv").unlink()
    code, said = said_by(capsys, copy)
    assert code == 1 and "lacks Barcodes.dat" in said and "not taken in" in said and "labkit-data-" not in said
    assert not data.exists()


# --------------------------------------------------------------------------------------- the page


def test_what_the_page_shows_works(tmp_path, monkeypatch):
    """Its files are a run, and its lines of Python run on it."""
    page = (ROOT / "docs" / "own-data.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w+) ?(\S*)\n(.*?)^```", page, re.M | re.S)
    (tmp_path / "hall").mkdir()
    for _, name, text in blocks:
        if name:
            (tmp_path / "hall" / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    scope = {"EKF": load_answer("04_legged_robot", "EKF", ROOT / "solutions")}
    for text in [text for kind, _, text in blocks if kind == "python"]:
        exec(text, scope)
    log = Log.load("hall")
    assert (log.name, log.range, len(log.seen)) == ("our hall, Monday", 6.0, 3)
    assert np.isfinite(log.truth).all() and log.seen_step.tolist() == [0, 1, 1]
    np.testing.assert_allclose(log.controls[1], (0.2, np.deg2rad(5.7)))
    assert scope["log"].name == Log.load("round the post").name == "round the post"
    assert metrics.rmse(scope["history"], scope["log"]) < 0.3
    offset = log.map[log.map.index(3)].p - log.truth[1, :2]
    np.testing.assert_allclose(log.seen[0], (np.hypot(*offset), np.arctan2(*offset[::-1]) - log.truth[1, 2]), atol=0.1)
