"""Keep a robot when its link breaks: calls wait until the link is back, and camera and LEDs are as before."""

from pathlib import Path

import elib

GAP = 'description = "No link from 3 s to 6 s"\n[[fault]]\nkind = "cut"\nfrom = 3\nuntil = 6\n'
Path("gap.toml").write_text(GAP)
URL = elib.robot_url("sim://?speed=max&fault=gap.toml")  # or what the command line names

with elib.reconnecting(URL, longest_delay=1.0) as robot:
    events = robot.events  # they are kept from here on
    robot.set_camera(width=20, height=20, mode=elib.CameraMode.GREY)
    robot.set_body_led(elib.LedAction.ON)
    robot.set_speed(0.1, 0.1)
    robot.sleep(4)  # meanwhile the link breaks, and the robot drives on
    try:
        robot.within(0.5).set_speed(0, 0)
    except elib.ReplyTimeout as error:
        print("no link in time:", error.message)
    print("steps after the gap:", robot.within(10).encoders().left)  # waits for the link
    print("the picture still has", robot.image().width, "columns")
    for event in events.recent:
        print(f"{event.time:.1f} s: {type(event).__name__}")
