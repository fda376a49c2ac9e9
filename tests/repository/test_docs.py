"""The docs: links lead to files, every block is run or says why not, and the reference pages equal
the code."""

import re
import runpy

import pytest

from ..support.rooms import ROOT

DOCS = runpy.run_path(str(ROOT / ".ci/docs.py"), run_name="docs_check")


def test_links_lead_to_files_and_every_block_is_run_or_says_why_not():
    for page in DOCS["pages"]():
        text = page.read_text("utf-8")
        for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", text):
            assert "://" in link or (page.parent / link).exists(), (page.name, link)
        blocks = DOCS["blocks"](text)  # refuses a block that would be passed over
        assert all(block.reason is None or len(block.reason) > 3 for block in blocks), page.name
        if page.parent.name == "tutorials":
            assert any(block.reason is None for block in blocks), page.name
    with pytest.raises(ValueError, match="line 2"):
        DOCS["blocks"]("Words.\n```sh\nplace-rings\n```\n")


def test_quoted_lines_stand_in_the_output_in_their_order_with_numbers_to_a_percent():
    missing = DOCS["missing"]
    assert missing("ζ 44.57 %\n…\n│ n2 │ … │", "a\nζ 44.60 %\nb\n│  n2 │ 1.0 │ 2.0 │") is None
    assert missing("ζ 44.57 %", "ζ 45.57 %") == "ζ 44.57 %"
    assert missing("2nd\n1st", "1st\n2nd") == "1st"


def test_reference_pages_equal_the_code_and_have_every_public_name():
    reference = runpy.run_path(str(ROOT / "docs/reference.py"), run_name="reference")
    folder = ROOT / "docs/reference"
    for name in ("api", "commands", "files"):
        text = (folder / f"{name}.md").read_text("utf-8")
        assert reference["page"](text) == text, "run: python docs/reference.py"
    assert reference["missing"]((folder / "api.md").read_text("utf-8")) == set()
    assert "<!-- keys: others -->" in (folder / "files.md").read_text("utf-8")
