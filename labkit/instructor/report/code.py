"""Students' code as the gradebook keeps it: read by people and compared, never run from here."""

import json
import zlib
from collections.abc import Mapping

from ..intake.submission import Work
from .gradebook import Gradebook

LONGEST = 500_000  # characters of one submission; an answer to a whole lab has some ten thousand
_TABLE = "CREATE TABLE IF NOT EXISTS code (submission INTEGER PRIMARY KEY, data BLOB)"  # older gradebooks have none


def keep(book: Gradebook, id: int, work: Work) -> None:
    """Keep the code of a submission, cut, unless it is kept already."""
    book.db.execute(_TABLE)
    if book.db.execute("SELECT 1 FROM code WHERE submission = ?", (id,)).fetchall():
        return
    modules = {name: text.decode("utf-8", "replace") for name, text in work.files.items() if name.endswith(".py")}
    kept, left = {}, LONGEST
    for name, text in {**work.sources, **modules}.items():
        kept[name] = text[:left]
        left -= len(kept[name])
    book.db.execute("INSERT INTO code VALUES (?, ?)", (id, zlib.compress(json.dumps(kept).encode())))


def kept(book: Gradebook, lab: str) -> Mapping[int, dict[str, str]]:
    """{id of a submission that counts: {name of a cell or module: its text}}; older kits have kept none."""
    book.db.execute(_TABLE)
    query = "SELECT id, data FROM code JOIN submission ON id = submission WHERE lab = ? AND current = 1"
    return {id: json.loads(zlib.decompress(data)) for id, data in book.db.execute(query, (lab,))}
