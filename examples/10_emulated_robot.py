"""Test against an emulated robot: the bytes that it sends and the LEDs that it turns on, without real time."""

from elib.testing import EmulatedRobot

robot = EmulatedRobot("btcom-2.0", {"selector": 7})
assert b"WELCOME" in robot.boot

answer = robot.send(b"C\r")
assert answer == b"c,7\r\n"
print("selector:", answer)

robot.send(b"L,2,1\r")
print("ring LEDs:", robot.hardware["led"])

robot.set(selector=3)  # somebody turns the switch
print("selector:", robot.send(b"C\r"))

robot.send(b"D,500,500\r")
robot.tick(10_000)  # one second of motor time
print("steps:", robot.send(b"Q\r"))
