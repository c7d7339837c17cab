"""What happened, kept and read again: logs, recordings, captured bytes.

It stands on ``base`` and ``link`` and knows neither a robot's API nor a simulator. Begin with ``topics.py`` (what a
recording holds), then ``recorder.py`` and ``reader.py``. ``log.py`` writes the log of 2011, ``et`` are the tools for
it, and ``decoding`` shows captured bytes as lines.
"""
