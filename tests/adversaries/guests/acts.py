"""What a method may do that no method should: an act each, done wherever the method is asked to do it.

An act that returns lets the method go on as a good one. `pipes` are the descriptors of requests and replies.
"""

import ctypes
import json
import os
import resource
import signal
import struct
import sys
import threading
import time

import numpy as np

MAGIC = b"TSLM"


def pipes():
    """Requests and replies, as the command line of this process names them."""
    return [int(word) for word in sys.argv[1:3]]


def say(header, payload=b""):
    """Write a message of our own into the reply pipe."""
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    os.write(pipes()[1], struct.pack("<4sII", MAGIC, len(text), len(payload)) + text + payload)


def exits_0():
    sys.exit(0)


def exits_1():
    sys.exit(1)


def exits_at_once_0():
    os._exit(0)


def exits_at_once_137():
    os._exit(137)


def segfault():
    ctypes.string_at(0)


def kills_itself():
    os.kill(os.getpid(), signal.SIGKILL)


def aborts():
    os.abort()


def bus_error():
    os.kill(os.getpid(), signal.SIGBUS)


def raises():
    raise ValueError("scan does not match")


def raises_escapes():
    raise RuntimeError("\x1b[2J\x1b]0;owned\x07\x1b[31m red \u202e txt.exe \x00 \ud800 [bold]x[/bold] ]]> & <b>")


def raises_much():
    raise RuntimeError("x" * 5_000_000)


def raises_keyboard_interrupt():
    raise KeyboardInterrupt


def raises_generator_exit():
    raise GeneratorExit


def raises_what_cannot_be_printed():
    class NamelessError(Exception):
        def __str__(self):
            raise RuntimeError("no words")

    raise NamelessError


def recurses():
    return recurses()


def hangs():
    while True:
        time.sleep(0.05)


def hangs_and_ignores_signals():
    for number in range(1, 32):
        if number not in (signal.SIGKILL, signal.SIGSTOP):
            signal.signal(number, signal.SIG_IGN)
    hangs()


def stops_itself():
    os.kill(os.getpid(), signal.SIGSTOP)


def spins():
    while True:
        pass


def eats_memory():
    hoard = []
    while True:
        hoard.append(np.ones(1 << 21))


def eats_memory_in_a_child():
    if os.fork() == 0:
        eats_memory()
    hangs()


def prints_without_end():
    while True:
        os.write(1, b"spam \x1b[2J" * 4096)


def closes_everything():
    os.closerange(0, 256)
    hangs()


def closes_the_replies():
    os.close(pipes()[1])


def scribbles():
    for descriptor in range(3, 64):
        try:
            os.set_blocking(descriptor, False)
            os.write(descriptor, b"garbage" * 8)
        except OSError:
            continue


def says_nothing_slowly():
    """A message whose end never comes, a byte at a time."""
    os.write(pipes()[1], struct.pack("<4sII", MAGIC, 1 << 19, 0))
    while True:
        os.write(pipes()[1], b" ")
        time.sleep(0.01)


def says_deep_json():
    say(b"[" * 100_000 + b"]" * 100_000)


def says_deep_objects():
    say(b'{"say":' * 50_000 + b"1" + b"}" * 50_000)


def says_no_object():
    say(b"[1, 2, 3]")


def says_no_text():
    say(b"\xff\xfe\xfd")


def says_a_huge_number():
    say(b'{"say": "done", "compute": 1, "number": ' + b"9" * 6000 + b"}")


def says_infinity():
    say(b'{"say": "done", "number": 1, "compute": 1e400}')


def says_negative_compute():
    say({"say": "done", "number": 1, "compute": -5})


def says_huge_compute():
    say({"say": "done", "number": 1, "compute": 10**300})


def says_a_message_of_the_future():
    say({"say": "done", "number": 10**9, "compute": 1})


def says_truths_for_numbers():
    say({"say": "done", "number": True, "compute": True})


def says_many_dimensions():
    say({"say": "done", "number": 1, "compute": 1, "arrays": [["a", "<f8", [1] * 70]]}, bytes(8))


def says_unhashable_names():
    say({"say": "done", "number": 1, "compute": 1, "arrays": [[{"a": 1}, ["<f8"], [1]]]}, bytes(8))


def says_a_boundless_shape():
    say({"say": "done", "number": 1, "compute": 1, "arrays": [["a", "<f8", [1 << 62, 1 << 62]]]}, bytes(8))


def says_an_unknown_word():
    say({"say": {"nested": ["x"] * 100}})


def forges_an_input_error():
    say({"say": "error", "kind": "input", "detail": "the user is to blame \x1b[31m", "number": None})


def forges_an_unhashable_error():
    say({"say": "error", "kind": ["input"], "detail": {"a": [1] * 10}, "number": []})


def forges_released_slots():
    say({"say": "done", "number": 1, "compute": 1, "released": [10**9, -1, "x", {}]})


def forges_a_released_word():
    say({"say": "done", "number": 1, "compute": 1, "released": "all"})


def answers_what_nobody_asked():
    for _ in range(100):
        say({"say": "answer", "card": {"name": 5}})


def leaves_a_daemon():
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            hangs()
        os._exit(0)


def leaves_a_stopped_child():
    if (child := os.fork()) == 0:
        hangs()
    os.kill(child, signal.SIGSTOP)


def leaves_a_thread():
    threading.Thread(target=hangs).start()


def forks_often():
    for _ in range(100):
        if os.fork() == 0:
            if os.fork() == 0:
                os.setsid()
            hangs()


def kills_everybody():
    for target in (os.getppid(), -1, 0, 1):
        try:
            os.kill(target, signal.SIGTERM)
        except OSError:
            continue


def stops_its_parent():
    for target in (os.getppid(), os.getpgid(os.getppid())):
        try:
            os.kill(target, signal.SIGSTOP)
        except OSError:
            continue


def removes_its_folder():
    os.chmod(".", 0)
    try:
        os.rename(os.getcwd(), os.getcwd() + "-gone")
    except OSError:
        pass


def leaves_a_closed_folder():
    os.makedirs("closed/within")
    with open("closed/within/file", "w") as file:
        file.write("x")
    os.chmod("closed/within", 0)
    os.chmod("closed", 0)


def limits_itself():
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


def becomes_another_program():
    os.execv("/bin/true", ["true"])


def patches_python():
    json.loads = json.dumps = None
    os.write = lambda *_: 0


def ends_python_early():
    import atexit

    atexit.register(segfault)


def breaks_the_output():
    sys.stdout = sys.stderr = None
    print("nothing")


ACTS = {
    name: act
    for name, act in list(globals().items())
    if callable(act) and getattr(act, "__module__", "") == __name__ and name not in ("pipes", "say")
}
