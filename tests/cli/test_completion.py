from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def test_completion_is_installed_where_the_shell_looks_and_names_commands(tmp_path: Path) -> None:
    code = "import sys; from taskslam.cli.main import main; sys.argv[0] = 'taskslam'; main()"

    def taskslam(*words: str, **more: str) -> str:
        command = [sys.executable, "-c", code, *words]
        environment = os.environ | {"HOME": str(tmp_path)} | more
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert "bash completion installed" in taskslam("--install-completion", "bash")
    script = tmp_path / ".bash_completions" / "taskslam.sh"
    assert "_taskslam_completion" in script.read_text(encoding="utf-8")
    assert str(script) in (tmp_path / ".bashrc").read_text(encoding="utf-8")
    answer = taskslam(_TASKSLAM_COMPLETE="complete_bash", COMP_WORDS="taskslam fig", COMP_CWORD="1")
    assert answer.split() == ["figures"]
