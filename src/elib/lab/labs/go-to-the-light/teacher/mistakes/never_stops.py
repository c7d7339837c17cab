# fails: stands: it turns back to the lamp each time it has passed it, and never stops
import elib

with elib.connect() as robot:
    while True:
        light = robot.ambient_light()
        right = light.front_right + light.diagonal_right + light.right
        left = light.front_left + light.diagonal_left + light.left
        if light.rear_left + light.rear_right < light.front_left + light.front_right:
            robot.set_speed(-0.2, 0.2)
        elif left < right - 30:
            robot.set_speed(0.1, 0.3)
        elif right < left - 30:
            robot.set_speed(0.3, 0.1)
        else:
            robot.set_speed(0.3, 0.3)
        robot.sleep(0.1)
