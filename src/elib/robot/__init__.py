"""One robot, or many: the API styles, motion, telemetry, events, reconnecting, and what stops a robot in an emergency.

It stands on ``link``, ``records`` and ``maps`` and knows no simulator: a virtual robot is a URL, as a real one. Begin
with ``aio.py`` (the async robot, which the other styles share), then ``motion.py``. ``swarms`` are several robots as
one, and ``runner.py`` is ``elib.run()``.
"""
