"""What Sphinx makes of two small pages, and what is said of a fault in them."""

import re
import shutil

import pytest

from labkit.instructor.records import CommandError
from labkit.instructor.site import api, lab, pages, sphinx

from helpers.reference import ROOT

for needed in ("sphinx", "myst_parser", "furo"):
    pytest.importorskip(needed)

INDEX = """# Here

[There](there.md#a-place)

$$ K = \\frac{P}{P + R} $$

```{toctree}
:caption: All

there
```
"""
THERE = "# There\n\n## A place\n\nSo $x_1$.\n\n```{eval-rst}\n.. autofunction:: labkit.geometry.wrap\n```\n"


def _build(folder, **texts):
    shutil.copytree(pages.LOOK, folder / "pages" / "look")
    for name, text in texts.items():
        (folder / "pages" / f"{name}.md").write_text(text)
    sphinx.build(folder / "pages", folder / "site")
    return {path.name: path.read_text("utf-8") for path in (folder / "site").glob("*.html")}


def test_a_page_has_formulas_and_the_reference_and_asks_for_nothing_elsewhere(tmp_path):
    made = _build(tmp_path, index=INDEX, there=THERE)
    assert '<math display="block"' in made["index.html"] and "<msub>" in made["there.html"]
    assert 'href="there.html#a-place"' in made["index.html"] and 'id="labkit.geometry.wrap"' in made["there.html"]
    asked = [re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="(\w+:|//)[^"]*"', page) for page in made.values()]
    assert asked and not any(asked)
    assert 'role="heading" aria-level="2"' in made["index.html"]


@pytest.mark.parametrize(
    "text, told",
    [
        (INDEX.replace("#a-place", "#no-such-place"), r"index\.md:3: .*no-such-place"),
        (INDEX.replace("frac", "nosuchcommand"), r"A formula cannot be shown as MathML: K = \\nosuchcommand"),
    ],
)
def test_a_fault_in_a_page_is_told(tmp_path, text, told):
    with pytest.raises(CommandError, match=told):
        _build(tmp_path, index=text, there=THERE)


def test_no_link_between_the_projects_own_pages_is_dead(tmp_path, monkeypatch):
    """Labs and reference, which take longer, are left out here; test_site has them."""
    monkeypatch.setattr(lab, "page", lambda student, executed, folder, lite: folder.mkdir(parents=True) or "# A lab")
    monkeypatch.setattr(api, "pages", lambda labkit: {})
    pages.write(ROOT, tmp_path / "pages")
    sphinx.build(tmp_path / "pages", tmp_path / "site")
    assert (tmp_path / "site" / "docs" / "plan.html").exists()
