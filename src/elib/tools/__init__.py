"""For robots that do not answer, are not found, or need new firmware; and the text of a machine of states.

It stands on ``link``, ``robot`` and the simulator's list of running robots. Begin with ``diagnosis/doctor.py``, which
checks a link step by step; ``discovery.py`` lists what there is to connect to, ``flash`` writes a program into an
e-puck1, and ``states`` reads, edits and draws the states of a program.
"""
