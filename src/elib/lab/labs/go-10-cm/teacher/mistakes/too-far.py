# fails: go-10-cm: one turn of a wheel is 12.9 cm, not 10 cm
import elib

with elib.connect() as robot:
    robot.set_speed(0.5, 0.5)
    robot.sleep(2.0)
    robot.stop()
