# fails: close: it drives a distance that was measured in one room, and does not look
import elib

with elib.connect() as robot:
    robot.drive(0.39)
