"""What everything stands on: errors, the robot's measures, poses, time, and the rules for values.

It imports nothing else of elib. Begin with ``errors`` (what a program can catch), then ``body`` (wheels, axle, sensor
directions) and ``timebase`` (the event loops, in real and in simulated time). ``rules`` and ``tables`` say what a
value of a call or a file must be.
"""
