# fails: corners: turn() takes radians, and 90 of them are fourteen turns, which elib refuses
import elib

with elib.connect() as robot:
    for _ in range(4):
        robot.drive(0.20)
        robot.turn(90)
