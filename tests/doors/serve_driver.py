"""A program that drives a robot of the door until it is killed: ``serve_driver.py URL ROBOT``."""

import json
import sys
import time

from websockets.sync.client import connect

url, robot = sys.argv[1:]
with connect(url, compression=None, proxy=None) as socket:
    socket.send(json.dumps({"do": "set_speed", "id": 1, "robot": robot, "left": 0.5, "right": 0.4}))
    answer = json.loads(socket.recv())
    assert answer["ok"], answer
    print("driving", flush=True)
    while True:
        # Not only a beat: where the machine was too busy for one, the robot has been stopped, and drives on now.
        socket.send(json.dumps({"do": "set_speed", "robot": robot, "left": 0.5, "right": 0.4}))
        time.sleep(0.1)  # noqa: TID251  # clock: it beats until it is killed, and nothing is read after that
