"""Where tests find the real robots' data."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def set7():
    """Folder of the real data set 7, or skip."""
    for base in (os.environ.get("LABKIT_DATA", ROOT / "data"), ROOT / "data", ROOT.parent / "shared" / "data"):
        for folder in (Path(base, "MRCLAM_Dataset7"), Path(base, "mrclam", "MRCLAM_Dataset7")):
            if folder.is_dir():
                return folder
    pytest.skip("the real data set MRCLAM_Dataset7 is not on this computer")
