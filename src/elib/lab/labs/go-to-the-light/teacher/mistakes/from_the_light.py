# fails: arrives: it takes a high reading for much light, but high is dark, so it drives away from the lamp
import elib

with elib.connect() as robot:
    while True:
        light = robot.ambient_light()
        right = light.front_right + light.diagonal_right + light.right
        left = light.front_left + light.diagonal_left + light.left
        if left > right + 30:
            robot.set_speed(0.1, 0.3)
        elif right > left + 30:
            robot.set_speed(0.3, 0.1)
        else:
            robot.set_speed(0.3, 0.3)
        robot.sleep(0.1)
