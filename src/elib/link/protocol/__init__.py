"""What is said on the wire: commands, their answers, and the firmwares' differences, as data. No I/O, no clock.

Each module needs only those before it: ``quantities``, ``image`` and ``values``; ``context``; ``replies`` and
``shapes``; ``forms`` and ``actuators``; ``profiles``; ``styles`` and ``table``; ``commands``; ``raw`` and
``connection``. The robot's side of the wire, ``robot_connection``, needs none of them.
"""
