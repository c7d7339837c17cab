"""The names of the Gymnasium environments: ``elib/Avoid-v0`` and the others."""

from __future__ import annotations

import pkgutil

from elib.learn import tasks


def register() -> None:
    """Register an environment for each task that comes with elib. Safe to repeat.

    The tasks themselves are not imported before they are used.
    """
    import gymnasium

    for module in pkgutil.iter_modules(tasks.__path__):
        name = f"elib/{module.name.title().replace('_', '')}-v0"
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="elib.learn.envs:TaskEnv",
                vector_entry_point="elib.learn.envs:TaskVectorEnv",
                kwargs={"task": module.name.replace("_", "-")},
            )
