"""A method that looks for the truth wherever a process can look, and prints all that it finds."""

import gc
import os
import sys
from pathlib import Path

from taskslam.measurements import Sensor
from taskslam.slam import Kind, MethodCard
from taskslam.slam.methods.wheel_odometry import WheelOdometryMethod


class Snoop(WheelOdometryMethod):
    card = MethodCard("snoop", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY))

    def __init__(self, redlof: str, host: int):
        self.host = host
        self.results = Path(redlof[::-1])  # written backwards, as the files that options name can be read
        self.snooped = False

    def feed(self, measurement):
        if measurement.sensor is Sensor.LASER_SCAN:
            if measurement.stamp > 4_000_000_000 and not self.snooped:
                self.snooped = True
                self.snoop()
            return self.last
        self.last = super().feed(measurement)
        return None

    def snoop(self):
        for process in (self.host, os.getppid()):
            self.snoop_at(process)
        for folder in ("/proc", "/sys", "/home", "/root", "/tmp", "/var", "/dev", str(Path.home().parent)):
            self.entries(Path(folder))
        self.look_around()

    def snoop_at(self, host):
        for name in ("cmdline", "status", "stat", "comm", "wchan"):
            self.read(Path(f"/proc/{host}/{name}"))
        for name in ("environ", "mem", "maps", "auxv", "syscall"):
            self.read(Path(f"/proc/{host}/{name}"))
        for name in ("fd", "task", "map_files"):
            for entry in self.entries(Path(f"/proc/{host}/{name}")):
                if name != "task":
                    self.follow(entry)
                    self.read(entry)
        for link in ("cwd", "exe", "root"):
            self.follow(Path(f"/proc/{host}/{link}"))

    def look_around(self):
        for descriptor in Path("/proc/self/fd").iterdir():
            try:
                print("OWN", descriptor.name, descriptor.readlink())
            except OSError:
                continue
        for path in (self.results, self.results / "truth.tum", *self.entries(self.results)):
            self.read(path)
        for module in (sys.modules[name] for name in sorted(sys.modules)):
            print("MODULE", module.__name__)
        for found in gc.get_objects():
            if isinstance(found, (dict, list, tuple)) and len(found) < 100:
                print("OBJECT", repr(found)[:300])
        print("ENVIRON", dict(os.environ), Path.cwd(), sys.argv, sys.path)
        print("SNOOPED")

    def entries(self, folder):
        try:
            return sorted(folder.iterdir())
        except OSError as error:
            print("DENIED", folder, error)
            return []

    def read(self, path):
        try:
            with path.open("rb") as file:
                if path.name == "mem":
                    file.seek(id(self))
                print("READ", path, file.read(4096))
        except (OSError, ValueError) as error:
            print("DENIED", path, error)

    def follow(self, link):
        try:
            print("LINK", link, link.readlink())
        except OSError as error:
            print("DENIED", link, error)
