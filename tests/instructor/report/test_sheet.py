"""CSV files as other programs write them: each byte stays that nobody set."""

import random

import pytest

from labkit.instructor.report.sheet import Sheet


@pytest.mark.parametrize("seed", range(30))
def test_a_sheet_saves_what_it_read(tmp_path, seed):
    pick = random.Random(seed)
    data = "a,b\n" + "".join(pick.choices('a"",,,;\t\r\n é\x0b\u2028=', k=200))
    path = tmp_path / "s.csv"
    path.write_bytes(data.encode())
    sheet = Sheet(path)
    sheet.save(path)
    assert path.read_bytes() == data.encode()
    for row, column, text in ((0, 1, "x,y"), (0, 5, 'quo"ted'), (len(sheet._raw) - 1, 0, "two\nlines")):
        sheet.put(row, column, text)
        assert sheet.row(row)[column] == text
