"""What is kept of a session: the log of its calls."""

from elib.recording.log import Log, log_robot

__all__ = ["Log", "log_robot"]
