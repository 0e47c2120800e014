"""What people and their tools do to a notebook with right answers: it deserves the same marks afterwards.

A change takes the list of cells (their sources are texts) and changes it; ANSWER is the cell with the last class.
"""

import re
from copy import deepcopy

from .notebooks import code


def answer(cells):
    """The place of the answer that defines the lab's last class, or else its last function."""
    found = [i for i, cell in enumerate(cells) if is_answer(cell) and re.search(r"(?m)^class \w", cell["source"])]
    return (found or [i for i, cell in enumerate(cells) if is_answer(cell)])[-1]


def is_answer(cell):
    return cell["cell_type"] == "code" and cell.get("id", "").startswith("answer")


def put(cells, at, *new):
    cells[at:at] = new


def without_ids(cells):
    for cell in cells:
        del cell["id"]


def with_new_ids(cells):
    for number, cell in enumerate(cells):
        cell["id"] = f"{number + 4096:08x}"


def without_ids_and_metadata(cells):
    for cell in cells:
        del cell["id"]
        cell["metadata"] = {}


def copied_and_deleted(cells):
    at = answer(cells)
    cells[at] = {**deepcopy(cells[at]), "id": "0badcafe"}


def copied_stub_below(cells):
    """The right answer in a cell of one's own above, the stub where it was."""
    at = answer(cells)
    name = re.findall(r"(?m)^(?:class|def) (\w+)", cells[at]["source"])[-1]
    put(cells, at, code(cells[at]["source"], "0badcafe"))
    cells[at + 1]["source"] = f"def {name}(*args):\n    raise NotImplementedError('still to be written')"


def rewritten(cells):
    at = answer(cells)
    cells[at] = code(cells[at]["source"], "0badcafe")


def moved_to_the_end(cells):
    cells.append(cells.pop(answer(cells)))


def backwards(cells):
    cells.reverse()


def merged(cells):
    """All answers in the cell of the first."""
    places = [i for i, cell in enumerate(cells) if is_answer(cell)]
    cells[places[0]]["source"] = "\n\n".join(cells[i]["source"] for i in places)
    for i in places[:0:-1]:
        del cells[i]


def merged_with_its_check(cells):
    at = answer(cells)
    cells[at]["source"] += "\n\n" + cells.pop(at + 1)["source"]


def split(cells):
    at = answer(cells)
    parts = re.split(r"(?m)^(?=(?:class|def|@) ?\w)", cells[at]["source"])
    cells[at : at + 1] = [code(part, f"0bad{i:04x}") for i, part in enumerate(parts) if part.strip()]


def at_id(cells, id):
    return next(i for i, cell in enumerate(cells) if cell["id"] == id)


def first_shown(cells):
    """Where the first cell stands that shows something and is none of the student's."""
    return next(i for i, cell in enumerate(cells) if cell["id"].startswith("show"))


def in_the_set_up(cells):
    source = cells.pop(answer(cells))["source"]
    cells[at_id(cells, "setup")]["source"] += f"\n\n{source}"


def in_the_checks_cell(cells):
    at = answer(cells)
    cells[at + 1]["source"] = cells[at]["source"] + "\n\n" + cells[at + 1]["source"]
    del cells[at]


def retyped(cells):
    cells[answer(cells)]["cell_type"] = "markdown"


def without_set_up(cells):
    del cells[at_id(cells, "setup")]


def without_checks(cells):
    cells[:] = [cell for cell in cells if "check(" not in cell["source"] or is_answer(cell)]


def with_magics(cells):
    at = answer(cells)
    cells[at]["source"] = "%%time\n%matplotlib inline\n!echo a \\\n  b\n" + cells[at]["source"] + "\nnp.kron?\n"


def with_future(cells):
    at = answer(cells)
    cells[at]["source"] = "from __future__ import annotations\n" + cells[at]["source"]


def with_await(cells):
    at = answer(cells)
    cells[at]["source"] = "import asyncio\nawait asyncio.sleep(0)\n" + cells[at]["source"]


def with_plots(cells):
    at = answer(cells)
    loop = "for k in range(30):\n    fig, ax = plt.subplots()\n    ax.plot(np.random.rand(400))\n    plt.show()\n"
    cells[at]["source"] += f"\n\nimport matplotlib.pyplot as plt\n{loop}    print('step', k)\n"


def with_questions(cells):
    put(cells, answer(cells) + 1, code("n = int(input('how many? '))\nprint(n)", "0badcafe"))


def with_errors_and_loops(cells):
    at = answer(cells)
    cells[at]["source"] += "\n\n1 / 0"
    put(cells, at, code("1 / 0", "0badcaf1"), code("while True: pass", "0badcaf2"), code("def broken(:", "0badcaf3"))


def with_a_helper(place):
    def change(cells):
        at = answer(cells)
        where = {"set-up": at_id(cells, "setup"), "show": first_shown(cells), "check": at + 1, "own": at}[place]
        if place == "own":
            put(cells, at, code("", "0badcafe"))
        cells[where]["source"] += "\n\nfrom functools import cache as kept\n\ndef as_is(thing):\n    return thing\n"
        decorated = answer(cells)
        cells[decorated]["source"] = re.sub(r"(?m)^(?=class |def )", "@as_is\n", cells[decorated]["source"])

    return change


def with_a_written_module(cells):
    at = answer(cells)
    text = "def as_is(thing):\n    return thing\n"
    put(cells, at, code(f"%%writefile my_helpers.py\n{text}", "0badcafe"))
    at += 1
    cells[at]["source"] = "import my_helpers\n" + re.sub(
        r"(?m)^(?=class |def )", "@my_helpers.as_is\n", cells[at]["source"]
    )


def methods_later(cells):
    at = answer(cells)
    name = re.findall(r"(?m)^(?:class) (\w+)", cells[at]["source"])
    if name:
        line = f"{name[-1]}.update, kept = None, {name[-1]}.update"
        put(cells, at + 1, code(line, "0badcaf1"), code(f"setattr({name[-1]}, 'update', kept)", "0badcaf2"))


CHANGES = {
    "plain": lambda cells: None,
    "ids dropped": without_ids,
    "ids new": with_new_ids,
    "ids and metadata dropped": without_ids_and_metadata,
    "copied, the original deleted": copied_and_deleted,
    "answered above the stub": copied_stub_below,
    "rewritten": rewritten,
    "moved to the end": moved_to_the_end,
    "backwards": backwards,
    "merged": merged,
    "merged with its check": merged_with_its_check,
    "split": split,
    "in the set-up": in_the_set_up,
    "in the check's cell": in_the_checks_cell,
    "retyped": retyped,
    "without the set-up": without_set_up,
    "without checks": without_checks,
    "magics": with_magics,
    "from __future__": with_future,
    "await": with_await,
    "plots": with_plots,
    "questions": with_questions,
    "errors and loops": with_errors_and_loops,
    "a written module": with_a_written_module,
    "methods later": methods_later,
    **{f"a helper in the {place}'s cell": with_a_helper(place) for place in ("set-up", "show", "check", "own")},
}
