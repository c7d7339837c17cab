"""For robots that do not answer, are not found, or need new firmware: the doctor, the search and the flasher.

It stands on ``link``, ``robot`` and the simulator's list of running robots. Begin with ``diagnosis/doctor.py``, which
checks a link step by step;
``discovery.py`` lists what there is to connect to, and ``flash`` writes a program into an e-puck1.
"""
