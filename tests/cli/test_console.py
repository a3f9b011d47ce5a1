"""Nothing that the command line prints acts on a terminal, whoever wrote it."""

import re
from pathlib import Path

from rich.table import Table
from rich.text import Text

from taskslam.cli.console import say, standard_error, standard_output

EVIL = "\x1b[31mred\x1b]0;owned\x07 [bold]name[/] \u202eback \ud800"
SHOWN = "red [bold]name[/] back \ufffd"


def test_a_sentence_is_printed_without_what_acts_on_a_terminal(capsys):
    say(EVIL)
    say(EVIL, err=True)
    assert capsys.readouterr() == (f"{SHOWN}\n", f"{SHOWN}\n")


def test_a_table_its_title_and_styled_text_are_too(capsys):
    table = Table(EVIL, title=EVIL)
    table.add_row(EVIL)
    console = standard_output()
    console.print(table)
    console.print(EVIL)
    console.print(Text.assemble(("\x1b[31mred", "bold"), "\x1b]0;"))
    standard_error().print(EVIL)
    printed = capsys.readouterr()
    assert printed.out.count(SHOWN) == 4
    assert SHOWN in printed.err
    assert not re.search("[\x1b\x07\u202e]", printed.out + printed.err)


def test_colours_of_our_own_stay(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    standard_output().print(Text("red", "red"))
    assert capsys.readouterr().out == "\x1b[31mred\x1b[0m\n"


def test_every_verb_prints_by_this_way_out():
    ways = re.compile(r"typer\.s?echo\(|typer\.secho\(|(?<![.\w])print\(|(?<!\w)Console\(|sys\.std(out|err)\.write")
    folder = Path(__file__).parents[2] / "src/taskslam/cli"
    verbs = [file for file in folder.glob("*.py") if file.name not in ("console.py", "main.py")]
    assert len(verbs) > 15
    assert [file.name for file in verbs if ways.search(file.read_text())] == []
