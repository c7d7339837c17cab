"""Test against an emulated robot: the bytes that it sends and the LEDs that it turns on, without real time."""

from elib.testing import EmulatedRobot

bench = EmulatedRobot("btcom-2.0", {"selector": 7})
assert b"WELCOME" in bench.boot

answer = bench.send(b"C\r")
assert answer == b"c,7\r\n"
print("selector:", answer)

bench.send(b"L,2,1\r")
print("ring LEDs:", bench.hardware["led"])

bench.set(selector=3)  # somebody turns the switch
print("selector:", bench.send(b"C\r"))

bench.send(b"D,500,500\r")
bench.tick(10_000)  # one second of motor time
print("steps:", bench.send(b"Q\r"))
