# fails: arrives: it stops at a brightness that it guessed, but the brightness depends on the lamp
import elib

with elib.connect() as robot:
    strongest = 0
    while strongest < 1800:
        light = robot.ambient_light()
        bright = [max(light) - count for count in light]
        right, left, strongest = sum(bright[:3]), sum(bright[5:]), max(bright)
        bend = max(-1.0, min(1.0, 1.5 * (left - right) / (left + right + 1)))
        robot.set_speed(0.3 * (1 - max(0.0, bend)), 0.3 * (1 + min(0.0, bend)))
        robot.sleep(0.1)
    robot.stop()
