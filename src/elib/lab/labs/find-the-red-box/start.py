"""Take a picture, save it, and print the colour in its middle."""

import elib

with elib.connect() as robot:
    robot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    picture = robot.image()
    picture.save("ahead.png", scale=8)
    red, green, blue = picture.pixels[20, 20]
    print("red", red, "green", green, "blue", blue)
