"""CSV files as other programs write them: `Sheet` changes single cells and keeps each other byte."""

import re
from collections import Counter
from pathlib import Path

from .. import files
from ..records import CommandError
from ..trouble import why

_BOMS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))


class Sheet:
    """A CSV file as it is: its cells can be read and single ones changed, and every other byte stays.

    Understood: UTF-8, UTF-16 with a byte order mark, else Windows' western letters; comma, semicolon or tab
    between cells; any line ends; a first line 'sep=;'.
    """

    def __init__(self, path: Path | str):
        """Read `path`; CommandError when it cannot be read, is no text or has nothing in it."""
        self.path = Path(path)
        try:
            data = self.path.read_bytes()
        except OSError as error:
            raise CommandError(f"{path} cannot be read: {why(error)}.") from None
        self.bom, self.codec = next((pair for pair in _BOMS if data.startswith(pair[0])), (b"", "utf-8"))
        text = self._decode(data[len(self.bom) :])
        lines = text.splitlines()
        full = [i for i, line in enumerate(lines) if line.strip(' \t,;"') and not line.startswith("sep=")]
        if not full:
            raise CommandError(f"{path} is empty; it should be a table whose first line names its columns.")
        self.top = full[0]
        outside = Counter(re.sub(r'"[^"]*"', "", lines[self.top]))
        self.comma = max(",;\t", key=lambda c: outside[c])
        if lines[0].startswith("sep="):
            self.comma = lines[0][4:5] or self.comma
        self._raw, self._ends = _split(text, re.escape(self.comma))

    def _decode(self, data: bytes) -> str:
        if data.startswith(b"PK\x03\x04"):
            raise CommandError(f"{self.path} is a workbook; in the spreadsheet, save it as 'CSV UTF-8'.")
        for codec in (self.codec, "cp1252"):
            try:
                text = data.decode(codec)
            except UnicodeDecodeError:
                continue
            if "\0" not in text:
                self.codec = codec
                return text
        raise CommandError(f"{self.path} is not a text file that can be read; save it as 'CSV UTF-8'.")

    @property
    def header(self) -> list[str]:
        """The cells of the line that names the columns."""
        return self.row(self.top)

    def row(self, index: int) -> list[str]:
        """The cells of row `index`, without their quotes."""
        return [_value(raw) for raw in self._raw[index]]

    def cell(self, index: int, column: int) -> str:
        """One cell's text without spaces around it, '' behind the end of its row."""
        row = self._raw[index]
        return _value(row[column]).strip() if column < len(row) else ""

    def body(self) -> list[int]:
        """The indices of the rows below the header that are not blank."""
        return [i for i in range(self.top + 1, len(self._raw)) if any(cell.strip() for cell in self.row(i))]

    def lines(self) -> list[tuple[int, list[str]]]:
        """(line number, cells) of each row below the header that is not blank."""
        return [(i + 1, self.row(i)) for i in self.body()]

    def seen(self, text: str) -> str:
        """`text` as this file's encoding can hold it."""
        return text.encode(self.codec, "replace").decode(self.codec)

    def put(self, index: int, column: int, text: str) -> None:
        """Set a cell; it has quotes if it had them before or needs them now."""
        row = self._raw[index]
        row += [""] * (column + 1 - len(row))
        if text != _value(row[column]):
            quoted = row[column].startswith('"') or re.search(r'["\s]', text) or self.comma in text
            row[column] = '"' + text.replace('"', '""') + '"' if quoted else text

    def save(self, out: Path) -> None:
        """Write the table to `out`. Raises CommandError when that cannot be done."""
        text = "".join(self.comma.join(row) + end for row, end in zip(self._raw, self._ends))
        files.write(out, self.bom + text.encode(self.codec, "replace"))


def _split(text: str, comma: str) -> tuple[list[list[str]], list[str]]:
    """The cells of each row as they stand in the file, quotes included, and the row's line end."""
    cell = re.compile(rf'("(?:[^"]++|"")*+"[^{comma}\r\n]*+|[^{comma}\r\n]*+)({comma}|\r\n|\r|\n|\Z)')
    rows, ends, at = [], [], 0
    row: list[str] = []
    while at < len(text) or row:
        found = cell.match(text, at)
        assert found  # one of its two ways matches anywhere
        at = found.end()
        row.append(found[1])
        if found[2] in ("\r\n", "\r", "\n", ""):
            rows.append(row)
            ends.append(found[2])
            row = []
    return rows, ends


def _value(raw: str) -> str:
    """The text of a cell as it stands in the file."""
    if not raw.startswith('"') or len(raw) < 2:
        return raw
    inside, _, behind = raw[1:].rpartition('"')
    return inside.replace('""', '"') + behind
