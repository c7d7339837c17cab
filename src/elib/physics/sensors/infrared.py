"""What the eight infrared sensors of a robot read: rays, response, noise and the ambient cap, on flat records.

Written for both engines: what a sensor cannot see is left out as early as possible, because interpreted every call
and every product counts.
"""

from __future__ import annotations

from typing import Final

from elib.physics.body import RADIUS as ROBOT_RADIUS
from elib.physics.body import SENSOR_RADIUS
from elib.physics.engine import compiled_as, kernel
from elib.physics.grid import cell
from elib.physics.layout import (
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    CELL_COLUMNS,
    CELL_ROWS,
    CELL_SCALE,
    CLEAR,
    DIGEST,
    DISC,
    DISC_ABSORBS,
    DISC_LISTS,
    DISC_RADIUS,
    DISC_TOP,
    FIRST,
    GAIN,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HALF_WIDTH,
    HEAD,
    HEADING_X,
    HEADING_Y,
    HEADS_AT,
    IR_REACH,
    KEY,
    LAST,
    LENGTH,
    LIGHTS,
    NEXT_AT,
    NUMBER,
    OFFSET,
    QUANTILES,
    RADIUS,
    RAY,
    RAY_COUNT,
    RAYS,
    REACH,
    READINGS,
    RESPONSE,
    ROBOT,
    ROBOTS,
    ROOM,
    SEEN,
    SENSOR_NOISE,
    SLOT,
    STEP,
    TANGENT_X,
    TANGENT_Y,
    TICK,
    UNEVEN,
    WALL,
    WALL_ABSORBS,
    WALL_FAR,
    WALL_LISTS,
    WALL_TOP,
    WALL_X,
    WALL_Y,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.noise import MASK, PROXIMITY, mix, tick_key
from elib.physics.noise import STRIDE as NEXT_CHANNEL
from elib.physics.sensors import lanes
from elib.physics.sensors.light import AMBIENT_DEVIATION, ROOMS, darkness, lamplight
from elib.physics.sensors.rays import (
    ABSORBS,
    CALM,
    DEVIATION,
    HITS,
    POSE,
    REFLECTED,
    SENSOR_HEIGHT,
    STRIDE,
    meet_disc,
    meet_wall,
)
from elib.physics.sensors.sectors import FAR, LIST, MARGIN, SECTORS, STRAY, STRAY_ANGLE, sector

COUNT: Final = 8

HORIZON: Final = SENSOR_RADIUS + 0.004
"""m. All sensors sit within it, also where they were a slot ago."""

TOUCHING: Final = ROBOT_RADIUS - MARGIN
"""m. Discs whose rims come nearer are not looked up: any sensor may see them."""

AMBIENT_MARGIN: Final = 4 * AMBIENT_DEVIATION  # Beyond any noise: below it the cap need not be looked up.


@kernel
def sense(
    robot: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Read a robot's eight sensors into its record, once a tick.

    The firmware samples one pair after the other, (0, 4), (1, 5), (2, 6), (3, 7): a reading is as old as its place in
    that row says, so a moving robot is looked up where it was then, by the straight line of its last tick. What it
    looks at counts where it is now.

    Args:
        robot: Whose.
        fixed: Settings, rays and response.
        robots: All robots.
        bodies: Pushable things.
        walls: All walls, seen from both sides.
        discs: All cylinders.
        cells: The grid of fixed things.
        numbers: The grid of moving things; out: the readings, and the digest of all so far.
        lights: All lamps.
        scratch: Room for the rays.
    """
    if numbers[HEAD + robot * NUMBER + SEEN] == numbers[TICK]:
        return
    look(robot, fixed, robots, bodies, walls, discs, cells, numbers, scratch)
    if numbers[LIGHTS] > 0:
        lamplight(robot, fixed, robots, walls, discs, lights, numbers, False, scratch)
    _respond(robot, fixed, robots, walls, discs, numbers, lights, scratch)


@kernel
def look(
    robot: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    scratch: Floats,
) -> None:
    """Find what each ray of a robot's sensors meets: its length, m, and 1 / reflectance, into *scratch*.

    The numbers of a sensor hold only if scratch[:data:`HITS` + sensor] is 1; otherwise it sees nothing.
    """
    r = robot * ROBOT
    here_x = robots[r + X]
    here_y = robots[r + Y]
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    for k in range(HITS, HITS + COUNT):
        scratch[k] = 0.0
    scratch[POSE] = heading_x
    scratch[POSE + 1] = heading_y
    scratch[POSE + 2] = heading_x - robots[r + BEFORE_HEADING_X]
    scratch[POSE + 3] = heading_y - robots[r + BEFORE_HEADING_Y]
    scratch[POSE + 4] = here_x - robots[r + BEFORE_X]
    scratch[POSE + 5] = here_y - robots[r + BEFORE_Y]
    share = robots[r + SLOT] / fixed[STEP]
    scratch[POSE + 6] = share
    step = scratch[POSE + 4] * scratch[POSE + 4] + scratch[POSE + 5] * scratch[POSE + 5]
    turn = scratch[POSE + 2] * scratch[POSE + 2] + scratch[POSE + 3] * scratch[POSE + 3]
    share *= 9.0 * share  # Three slots, squared.
    scratch[CALM] = 1.0 if share * step < STRAY * STRAY and share * turn < STRAY_ANGLE * STRAY_ANGLE else 0.0

    horizon = fixed[IR_REACH] + HORIZON
    scale = fixed[CELL_SCALE]
    columns = numbers[CELL_COLUMNS]
    here = 2 * (cell(here_y, scale, numbers[CELL_ROWS]) * columns + cell(here_x, scale, columns))
    first = cells[here]
    middle = cells[here + 1]
    last = cells[here + 2]
    for m in range(first, middle):
        w = cells[m] * WALL
        dx = walls[w] - here_x
        dy = walls[w + WALL_Y] - here_y
        tangent_x = walls[w + TANGENT_X]
        tangent_y = walls[w + TANGENT_Y]
        offset = tangent_x * dy - tangent_y * dx
        if -horizon < offset < horizon:
            _see_wall(w, offset, tangent_x * dx + tangent_y * dy, horizon, fixed, walls, numbers, scratch)
    for m in range(middle, last):
        d = cells[m] * DISC
        dx = discs[d] - here_x
        dy = discs[d + 1] - here_y
        radius = discs[d + DISC_RADIUS]
        limit = horizon + radius
        if dx * dx + dy * dy < limit * limit and discs[d + DISC_TOP] >= SENSOR_HEIGHT:
            _see_disc(dx, dy, radius, discs[d + DISC_ABSORBS], fixed, numbers, scratch)
    count = numbers[ROBOTS]
    if count + numbers[BODIES] == 1:
        return
    scale = fixed[GRID_SCALE]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    left = cell(here_x - 1.0 / scale, scale, columns)
    right = cell(here_x + 1.0 / scale, scale, columns) + 1
    top = cell(here_y + 1.0 / scale, scale, rows) + 1
    heads = numbers[HEADS_AT]
    following = numbers[NEXT_AT]
    limit = horizon + ROBOT_RADIUS
    limit *= limit
    for v in range(cell(here_y - 1.0 / scale, scale, rows), top):
        for u in range(left, right):
            j = numbers[heads + v * columns + u]
            while j >= 0:
                if j >= count:
                    _see_thing(
                        (j - count) * BODY, here_x, here_y, horizon, fixed, bodies, walls, discs, numbers, scratch
                    )
                elif j != robot:
                    dx = robots[j * ROBOT + X] - here_x
                    dy = robots[j * ROBOT + Y] - here_y
                    if dx * dx + dy * dy < limit:
                        _see_disc(dx, dy, robots[j * ROBOT + RADIUS], 1.0, fixed, numbers, scratch)
                j = numbers[following + j]


@kernel
def _see_thing(
    b: int,
    here_x: float,
    here_y: float,
    horizon: float,
    fixed: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    scratch: Floats,
) -> None:
    """Look at the pushable thing whose record begins at *b*."""
    dx = bodies[b + X] - here_x
    dy = bodies[b + Y] - here_y
    limit = horizon + bodies[b + REACH]
    if dx * dx + dy * dy >= limit * limit:
        return
    first = int(bodies[b + FIRST])
    if bodies[b + HALF_WIDTH] == 0.0:
        d = first * DISC
        if discs[d + DISC_TOP] >= SENSOR_HEIGHT:
            _see_disc(dx, dy, discs[d + DISC_RADIUS], discs[d + DISC_ABSORBS], fixed, numbers, scratch)
        return
    for side in range(first, first + 4):
        w = side * WALL
        dx = walls[w + WALL_X] - here_x
        dy = walls[w + WALL_Y] - here_y
        tangent_x = walls[w + TANGENT_X]
        tangent_y = walls[w + TANGENT_Y]
        offset = tangent_x * dy - tangent_y * dx
        if -horizon < offset < horizon:
            _see_wall(w, offset, tangent_x * dx + tangent_y * dy, horizon, fixed, walls, numbers, scratch)


@compiled_as(lanes.see_wall)
def _see_wall(
    w: int, offset: float, start: float, horizon: float, fixed: Floats, walls: Floats, numbers: Ints, scratch: Floats
) -> None:
    """Look at a wall whose line is *offset* to the left of the robot and which begins at *start* along it, m."""
    end = start + walls[w + LENGTH]
    if start > horizon or end < -horizon or walls[w + WALL_TOP] < SENSOR_HEIGHT:
        return
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    absorbs = walls[w + WALL_ABSORBS]
    heading_x = scratch[POSE]
    heading_y = scratch[POSE + 1]
    turn_x = scratch[POSE + 2]
    turn_y = scratch[POSE + 3]
    # What the robot's last step did along the wall and towards it.
    sideways = tangent_x * scratch[POSE + 4] + tangent_y * scratch[POSE + 5]
    nearer = tangent_x * scratch[POSE + 5] - tangent_y * scratch[POSE + 4]
    share = scratch[POSE + 6]
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    away = offset if offset >= 0.0 else -offset
    # Astride the wall's line, beyond its end, any sensor may see it.
    is_beside = away < HORIZON or scratch[CALM] == 0.0
    direction = 0
    count = COUNT
    if not is_beside:
        normal_x = tangent_x * heading_y - tangent_y * heading_x
        normal_y = tangent_x * heading_x + tangent_y * heading_y
        if offset < 0.0:
            normal_x = -normal_x
            normal_y = -normal_y
        direction = LIST * sector(normal_x, normal_y)
        count = numbers[WALL_LISTS + direction]
    for k in range(1, count + 1):
        sensor = k - 1
        if not is_beside:
            if away >= fixed[WALL_FAR + direction + k]:
                return
            sensor = numbers[WALL_LISTS + direction + k]
        age = share * (3 - (sensor & 3))
        then_x = heading_x - age * turn_x
        then_y = heading_y - age * turn_y
        back = age * sideways
        meet_wall(
            sensor,
            rays,
            tangent_x * then_y - tangent_y * then_x,
            tangent_x * then_x + tangent_y * then_y,
            offset + age * nearer,
            start + back,
            end + back,
            absorbs,
            reach,
            fixed,
            scratch,
        )


@compiled_as(lanes.see_disc)
def _see_disc(
    dx: float, dy: float, radius: float, absorbs: float, fixed: Floats, numbers: Ints, scratch: Floats
) -> None:
    """Look at a disc whose centre is (dx, dy) away from the robot's, m."""
    heading_x = scratch[POSE]
    heading_y = scratch[POSE + 1]
    turn_x = scratch[POSE + 2]
    turn_y = scratch[POSE + 3]
    step_x = scratch[POSE + 4]
    step_y = scratch[POSE + 5]
    share = scratch[POSE + 6]
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    listed = DISC_LISTS
    count = COUNT
    square = dx * dx + dy * dy
    # The lists are made for discs of up to a robot's size that do not overlap the robot.
    touching = radius + TOUCHING
    is_listed = radius <= ROBOT_RADIUS and square > touching * touching and scratch[CALM] > 0.0
    if is_listed:
        if square > FAR * FAR:
            listed += LIST * SECTORS
        listed += LIST * sector(dx * heading_x + dy * heading_y, dy * heading_x - dx * heading_y)
        count = numbers[listed]
    for k in range(count):
        sensor = k
        if is_listed:
            sensor = numbers[listed + 1 + k]
        age = share * (3 - (sensor & 3))
        then_x = heading_x - age * turn_x
        then_y = heading_y - age * turn_y
        back_x = dx + age * step_x
        back_y = dy + age * step_y
        meet_disc(
            sensor,
            rays,
            back_x * then_x + back_y * then_y,
            back_y * then_x - back_x * then_y,
            radius,
            absorbs,
            reach,
            fixed,
            scratch,
        )


@compiled_as(lanes.reflect)
def reflect(fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Find how much light each sensor gets back from what its rays meet, counts, and the deviation of its noise there.

    light = sum over rays of weight * response(depth / reflectance)
    """
    last_ray = RAYS + numbers[RAY_COUNT] * RAY
    last = numbers[LAST]
    deviations = RESPONSE + last + 1
    for i in range(COUNT):
        light = fixed[CLEAR]
        scratch[DEVIATION + i] = fixed[deviations + last]
        if scratch[HITS + i] > 0.0:
            light = 0.0
            k = i
            for ray in range(RAYS, last_ray, RAY):
                place = scratch[k] * fixed[ray + 2] * scratch[ABSORBS + k]
                place = place if place < last else last
                below = int(place)
                response = fixed[RESPONSE + below]
                response += (place - below) * (fixed[RESPONSE + below + 1] - response)
                if ray == RAYS:
                    scratch[DEVIATION + i] = fixed[deviations + below]
                light += fixed[ray + 3] * response
                k += STRIDE
        scratch[REFLECTED + i] = light


@kernel
def _respond(
    robot: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Turn what the rays met into reflected light.

    light = gain * what :func:`reflect` finds + offset + noise, cut at what the sensor
    reads with its emitter off, since the firmware sends the difference of the two.
    """
    n = HEAD + robot * NUMBER
    out = n + READINGS
    gains = robot * ROBOT + GAIN
    offsets = robot * ROBOT + OFFSET
    reflect(fixed, numbers, scratch)
    noise = fixed[SENSOR_NOISE]
    room = fixed[ROOM]
    margin = AMBIENT_MARGIN * noise
    is_lit = numbers[LIGHTS] > 0
    is_shaded = False
    is_uneven = numbers[UNEVEN] > 0
    key = tick_key(numbers[n + KEY], numbers[TICK])
    word = 0
    for i in range(COUNT):
        light = scratch[REFLECTED + i]
        if is_uneven:
            light = light * robots[gains + i] + robots[offsets + i]
        if noise > 0.0:
            if word < 1024:  # Three sensors share a word, ten bits each, below a bit that ends it.
                word = mix((key + (PROXIMITY + i) * NEXT_CHANNEL) & MASK) & 0x3FFFFFFF | 0x40000000
            light += scratch[DEVIATION + i] * noise * fixed[QUANTILES + (word & 1023)]
            word >>= 10
        if is_lit:
            room = scratch[ROOMS + i]
            if light > room - margin and not is_shaded:  # Only then do shadows matter, which cost a lot.
                is_shaded = True
                lamplight(robot, fixed, robots, walls, discs, lights, numbers, True, scratch)
                room = scratch[ROOMS + i]
        if light > room - margin:
            light = min(light, darkness(key, i, noise, room))
        numbers[out + i] = int((light if light > 0.0 else 0.0) + 0.5)
    numbers[n + SEEN] = numbers[TICK]
    m = n + READINGS
    digest = numbers[n + DIGEST]
    front = numbers[m] | numbers[m + 1] << 12 | numbers[m + 2] << 24 | numbers[m + 3] << 36
    rear = numbers[m + 4] | numbers[m + 5] << 12 | numbers[m + 6] << 24 | numbers[m + 7] << 36
    digest = ((digest ^ front) * 0x735A2D97) & 0xFFFFFFFFFFFF
    digest = (((digest ^ (digest >> 23)) ^ rear) * 0x21F0AAAD) & 0xFFFFFFFFFFFF
    numbers[n + DIGEST] = digest ^ (digest >> 23)
