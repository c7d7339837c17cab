"""Let controllers evolve that drive fast and avoid walls, then drive a robot by the best one (the extra ``learn``)."""

from dataclasses import replace

import elib
from elib.learn import Champion, Episodes, find_controller, find_task
from elib.learn.optimisers import optimiser

URL = elib.robot_url("sim://arena?speed=max")  # or what the command line names

task = replace(find_task("avoid"), seconds=15)
network = find_controller("recurrent", task.sensors, top_speed=task.top_speed)
worlds = Episodes(task)  # compiled, which takes a while at the first time
search = optimiser("ga", network.size, population=50, seed=1)
champions = []
for generation in range(1, 21):
    population = search.ask()  # a row of parameters for each of 50 networks
    fitness, steps = worlds.play(network.controller(population), population, seeds=[generation])
    search.tell(fitness.mean(axis=1), steps.mean(axis=1))
    champions.append(population[fitness.mean(axis=1).argmax()])
    print(f"generation {generation}: best {fitness.max():.2f}, mean {fitness.mean():.2f}")

champion = Champion("avoid", "recurrent", task.sensors, champions[-1])
result = elib.play(champion.behaviour(), URL, seconds=20)
print(f"the best one drove for {result.duration:.0f} s")
