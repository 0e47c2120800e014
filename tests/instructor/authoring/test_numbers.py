"""The numbers of the checks: what is stored, and when a file is written anew."""

import json

import numpy as np

from labkit.checks.trace import Trace
from labkit.instructor.authoring import numbers
from labkit.instructor.authoring.stored import pack


def packed(*values):
    return pack(Trace([[np.array(value) for value in values]]))[0][0]


def test_what_is_zero_but_for_rounding_is_stored_as_zero():
    assert packed([[2.0, 1.4e-16], [-3e-17, np.nan]], -2e-16) == [[[2.0, 0.0], [0.0, None]], 0.0]
    assert packed([1e-4, 3e-14, -0.0]) == [[1e-4, 0.0, 0.0]]
    assert packed([1e-8, 2e-12], 1.23456789) == [[1e-8, 2e-12], 1.234568]
    stored = [path.read_text("utf-8") for path in numbers.DATA.glob("*.json")]
    assert stored and not [text for text in stored if "e-16" in text or "e-17" in text]


def test_a_file_whose_numbers_are_alike_is_left_alone(tmp_path, monkeypatch):
    def write(**values):
        made = {
            name: {
                "name": name,
                "lab": "01_x",
                "subject": "f",
                "kind": "function",
                "scenarios": [{"right": value}],
                "mistakes": [],
            }
            for name, value in values.items()
        }
        monkeypatch.setattr(numbers, "generate", lambda root, labs: made)
        assert numbers.write(tmp_path, tmp_path) == sorted(values)
        return {path.stem: json.loads(path.read_text("utf-8"))["scenarios"][0]["right"] for path in tmp_path.iterdir()}

    assert write(a=1.234567, b=0.0) == {"a": 1.234567, "b": 0.0}
    assert write(a=1.234568, b=1e-12) == {"a": 1.234567, "b": 0.0}
    assert write(a=1.3, c=2.0) == {"a": 1.3, "c": 2.0}
