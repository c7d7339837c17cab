"""Let all robots look around at the same time, and print what each of them sees."""

import elib


async def main(robots: elib.Swarm) -> None:
    near = await robots.all.proximity()
    for name, reading in near.items():
        print(name, reading)


elib.swarm().run(main)
