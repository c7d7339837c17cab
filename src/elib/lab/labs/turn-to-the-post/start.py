"""Look at the eight sensors. Which of them see the post, and where do they look?"""

import elib

# Where the eight sensors look, degrees from straight ahead, positive to the left.
DIRECTIONS = (-17, -46, -90, -151, 151, 90, 46, 17)

with elib.connect() as robot:
    near = robot.proximity()
    for count, degrees in zip(near, DIRECTIONS, strict=True):
        print(f"{degrees:5} degrees: {count}")
