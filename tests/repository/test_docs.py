"""The docs' blocks: none is passed over, and what is quoted of an output has to stand in it."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

ROOT = Path(__file__).parents[2]
_spec = importlib.util.spec_from_file_location("docs_check", ROOT / ".ci" / "docs.py")
docs = sys.modules["docs_check"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(docs)

_LINES = st.lists(st.text("ab 1.#-", max_size=8).map(str.rstrip), max_size=4).map(
    lambda lines: "".join(f"{x}\n" for x in lines)
)
_REASON = st.none() | st.text("abc ,", min_size=1).map(str.strip).filter(bool)
_BLOCK = st.tuples(st.sampled_from(["bash", "python"]), _LINES, _REASON, st.none() | _LINES)


@pytest.mark.parametrize("page", docs.pages(), ids=lambda page: page.name)
def test_every_block_of_a_page_is_run_or_says_why_not(page):
    for block in docs.blocks(page.read_text()):
        assert block.reason is None or len(block.reason) > 3


@pytest.mark.parametrize(
    "page", [p for p in docs.pages() if p.parent.name == "tutorials"], ids=lambda page: page.name
)
def test_a_tutorial_is_run(page):
    assert any(block.reason is None for block in docs.blocks(page.read_text()))


@given(st.lists(_BLOCK, max_size=5))
def test_blocks_come_back_as_they_were_written(written):
    text = "# Page\n"
    for language, inside, reason, quoted in written:
        comment = f"<!-- no-run: {reason} -->\n" if reason else ""
        text += f"\nWords.\n\n{comment}```{language}\n{inside}```\n"
        text += f"\n```text\n{quoted}```\n" if quoted is not None else ""
    found = [(b.language, b.text, b.reason, b.quoted) for b in docs.blocks(text)]
    assert found == [tuple(block) for block in written]


@pytest.mark.parametrize(
    "fence",
    ["```sh", " ```bash", "```bash no-run: why", "```py", "~~~bash", "```{code-block} python"],
)
def test_a_block_that_would_be_passed_over_is_refused(fence):
    with pytest.raises(ValueError, match="line 2"):
        docs.blocks(f"Words.\n{fence}\nplace-rings\n```\n")


@given(st.lists(st.text("ab1.", min_size=1, max_size=5), min_size=1, max_size=6), st.data())
def test_some_lines_of_an_output_in_its_order_stand_in_it(lines, data):
    some = [line for line in lines if data.draw(st.booleans())]
    assert docs.missing("\n".join(some), "\n".join(lines)) is None


@pytest.mark.parametrize(
    ("quoted", "said", "stands"),
    [
        ("ζ 44.57 %", "ζ 44.60 %", True),
        ("ζ 44.57 %", "ζ 45.57 %", False),
        ("ζ 44.57 %", "ζ 44.57", False),
        ("│ n2 │ … │ 86.7 │", "│  n2 │ 1.0 │ 2.0 │ 86.71 │", True),
        ("│ n2 │ … │ 86.7 │", "│  n2 │ 86.7 │ 2.0 │", False),
        ("2nd\n1st", "1st\n2nd", False),
        ("1st\n…\n3rd", "1st\n2nd\n3rd", True),
    ],
)
def test_what_is_quoted_stands_in_the_output(quoted, said, stands):
    assert (docs.missing(quoted, said) is None) == stands


@pytest.mark.parametrize("page", docs.pages(), ids=lambda page: page.name)
def test_links_lead_to_files_that_are_there(page):
    for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", page.read_text()):
        if "://" not in link:
            assert (page.parent / link).exists(), link


@pytest.fixture(scope="module")
def reference():
    """The module that writes the generated sections."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["api", "commands", "files"])
def test_reference_pages_equal_the_code(reference, name):
    text = (ROOT / "docs" / "reference" / f"{name}.md").read_text("utf-8")
    assert reference.page(text) == text, "run: python docs/reference.py"


def test_the_reference_has_every_public_name_and_file(reference):
    page = ROOT / "docs" / "reference"
    assert reference.missing((page / "api.md").read_text("utf-8")) == set()
    assert "<!-- keys: others -->" in (page / "files.md").read_text("utf-8")


def test_a_new_mark_keeps_the_section_after_it(reference):
    text = "<!-- api: Shell -->\n\n<!-- api: ToolSphere -->\n\nold\n\n<!-- end -->\n\nText.\n"
    made = reference.page(text)
    assert made.count("<!-- end -->") == 2
    assert "### Shell" in made
    assert "### ToolSphere" in made
    assert "old" not in made
    assert made.endswith("\n\nText.\n")
    assert reference.page(made) == made
