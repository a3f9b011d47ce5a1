"""Debian's rosmaster on a port of its own; prints its URI."""

import sys

import rosmaster.master

master = rosmaster.master.Master(0)
master.start()
print(master.uri, flush=True)
sys.stdin.readline()
while master.ok():
    import time

    time.sleep(0.1)
