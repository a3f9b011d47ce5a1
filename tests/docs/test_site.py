"""The documentation builds without a warning: no broken link, no page left out."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]


def test_the_site_builds_without_a_warning(tmp_path):
    pytest.importorskip("material", reason="mkdocs-material comes with taskslam[docs]")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "site" / "tutorial" / "index.html").exists()


def test_lines_of_the_documentation_can_be_read_in_an_editor():
    """At most 160 columns, but for tables and code, which cannot be broken."""
    long = []
    for page in [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]:
        in_code = False
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
            in_code ^= line.lstrip().startswith("```")
            if not in_code and not line.startswith("|") and len(line) > 160:
                long.append(f"{page.name}:{number}")
    assert long == []


def test_the_citation_file_and_the_page_name_the_same_paper():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    page, paper = (ROOT / "docs" / "cite.md").read_text(encoding="utf-8"), citation["preferred-citation"]
    assert f"journal = {{{paper['journal']}}}" in page
    assert f"year    = {{{paper['year']}}}" in page
    assert paper["title"] in page.replace("{", "").replace("}", "")
    assert [author["family-names"] for author in paper["authors"]] == ["Du", "Feng", "Cort", "Vela"]
    assert f"version = {{{citation['version']}}}" in page
