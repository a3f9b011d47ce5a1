"""A method that leaves daemons, each forked twice into a session of its own, deaf to signals."""

import os
import signal
import time

from acts import ACTS
from adversary import Adversary


def live_on():
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)
    time.sleep(120)
    os._exit(0)


class Daemons(Adversary):
    def __init__(self, count: int, then: str = "") -> None:
        super().__init__()
        self.count, self.then = count, then

    def start(self, rig):
        super().start(rig)
        for _ in range(self.count):
            if (child := os.fork()) == 0:
                os.setsid()
                if os.fork() == 0:
                    live_on()
                os._exit(0)
            os.waitpid(child, 0)
        if self.then:
            ACTS[self.then]()
