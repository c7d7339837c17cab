"""Logs and recordings of robots: write them, read recordings back, replay them."""

from elib.recording.log import Log, Vocabulary
from elib.recording.reader import Entry, Health, Recording, Summary, Transfer, read_recording, summary_of
from elib.recording.recorder import Recorder

__all__ = [
    "Entry",
    "Health",
    "Log",
    "Recorder",
    "Recording",
    "Summary",
    "Transfer",
    "Vocabulary",
    "read_recording",
    "summary_of",
]
