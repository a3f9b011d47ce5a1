from taskslam.slam.orb import system_libraries
from taskslam.slam.orb.system_libraries import LIBRARIES, install_command, missing_libraries


def test_what_the_linker_does_not_find_is_missing(monkeypatch):
    monkeypatch.setitem(system_libraries.LIBRARIES, "libnothing-of-the-kind.so.7", "libnothing7")
    missing = missing_libraries()
    assert missing[-1] == "libnothing-of-the-kind.so.7"
    assert install_command(missing).endswith(" libnothing7")


def test_the_command_names_the_packages():
    assert install_command(list(LIBRARIES)[:2]) == "apt install libopengl0 libglx0"
