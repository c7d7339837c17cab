"""Real robots as the measure: figures that were measured on them, and the same figures of virtual robots beside them.

Begin with ``figures.py``, which reads ``measured.toml``. ``measures.py`` measures each quantity on the virtual robot of
a ``bench.py``, and ``parity.py`` puts both side by side. ``session.py`` records a real robot.
"""
