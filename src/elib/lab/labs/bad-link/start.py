"""Drive over a bad link until the first answer is lost. What should the robot do then?"""

import elib

with elib.connect() as robot:
    robot.calibrate_proximity()  # what the sensors read in the open is 0 from now on
    robot.set_speed(0.1, 0.1)
    try:
        while True:
            near = robot.proximity()
            print(f"{robot.time:.1f} s: {max(near)}")
            robot.sleep(0.1)
    except elib.ReplyTimeout as error:
        print(error.message)
