"""Take a picture and save it as picture.png."""

import elib

URL = elib.robot_url("sim://?speed=max")  # or what the command line names

with elib.connect(URL) as robot:
    robot.set_camera(width=52, height=39, zoom=8, mode=elib.CameraMode.GREY)
    picture = robot.image()
    darkest, brightest = picture.pixels.min(), picture.pixels.max()
    print(f"{picture.width} x {picture.height} pixels from {darkest} to {brightest}")
    picture.save("picture.png", scale=8)
