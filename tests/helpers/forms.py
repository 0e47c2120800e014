"""Right forms and known mistakes of a lab as notebooks."""

from labkit.instructor.authoring.spec import definitions

from .classroom import answers, blank, cell_is_code, filled, usable
from .reference import ROOT


def forms(lab, what):
    """{id: form} of all right forms or mistakes of a lab that are edits of the answer cells, or code behind them."""
    found = {}
    for check in definitions(ROOT):
        if check.lab == lab:
            for item in getattr(check, what):
                for n, form in enumerate(item.forms if what == "mistakes" else [item.form]):
                    found[f"{check.name} {item.id} {n}"] = (check.subject, form)
    return found


def in_notebook(lab, subject, form):
    """A notebook with a form of the solution; None if it cannot be made of edits in the answer cells."""
    if usable(lab, form):
        return filled(lab, form)
    if isinstance(form, str):
        holder = next(id for id, s in answers(lab).items() if cell_is_code(blank(lab), id) and f" {subject}" in s)
        return filled(lab, **{holder.replace("-", "_"): f"{answers(lab)[holder]}\n\n{form}"})
    return None
