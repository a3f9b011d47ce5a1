"""Methods that need more than the wall gives, and say so on their cards or by their options."""

import multiprocessing
from pathlib import Path

from adversary import Adversary

from taskslam.measurements import Sensor
from taskslam.slam import Kind, MethodCard


def hold(lock):
    with lock:
        pass


class Sharing(Adversary):
    card = MethodCard("sharing", "1", "MIT", Kind.SLAM, (Sensor.WHEEL_ODOMETRY,), shared_memory=True)

    def start(self, rig):
        super().start(rig)
        context = multiprocessing.get_context("fork")
        lock = context.Lock()
        workers = [context.Process(target=hold, args=(lock,)) for _ in range(2)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        Path("/dev/shm/left-behind").write_text("private, where the kernel allows it")
        print(f"locked in {sum(worker.exitcode == 0 for worker in workers)} processes", flush=True)


class Reading(Adversary):
    def __init__(self, vocabulary: str) -> None:
        super().__init__()
        print("read", Path(vocabulary).read_text())
        try:
            Path(vocabulary).write_text("changed")
        except OSError as error:
            print("denied", error.errno)
