from taskslam.navigation.velocity_smoother import Velocity


class Half:
    def __init__(self, robot):
        self.robot = robot

    def reset(self):
        """It cannot command."""


class GivesUp(Half):
    def command(self, request):
        return None


class Raises(Half):
    def command(self, request):
        raise ValueError("no idea\nwhere to go")


class NotANumber(Half):
    def command(self, request):
        return Velocity(float("nan"), 0.0)


class NotAVelocity(Half):
    def command(self, request):
        return 0.3, 0.0
