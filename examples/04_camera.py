"""Take a picture and save it as picture.png."""

import sys

import elib

URL = sys.argv[1] if len(sys.argv) > 1 else "sim://?speed=max"

with elib.connect(URL) as robot:
    robot.set_camera(width=52, height=39, zoom=8, mode=elib.CameraMode.GREY)
    picture = robot.image()
    darkest, brightest = picture.pixels.min(), picture.pixels.max()
    print(f"{picture.width} x {picture.height} pixels from {darkest} to {brightest}")
    picture.save("picture.png", scale=8)
