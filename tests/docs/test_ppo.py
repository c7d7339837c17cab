"""The program of the page "Learn by PPO", where Stable-Baselines3 is installed."""

import numpy as np
import pytest
from pages import ROOT, blocks

from elib.base.body import METRES_PER_STEP
from elib.learn import find_task
from elib.simulator.physics.records import SensorView

PAGE = ROOT / "docs/guides/ppo.md"


@pytest.mark.long
@pytest.mark.parametrize("kind", ["feedforward", "recurrent"])
def test_a_network_that_ppo_has_trained_decides_the_same_as_a_champion(kind):
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed: docs/guides/ppo.md")
    page = {"__name__": "ppo"}
    exec(compile(blocks(PAGE, "python")[0].text, str(PAGE), "exec"), page)
    task = find_task("avoid")
    model = page["learn"](task, kind, decisions=1600, worlds=25)
    found = page["champion"](model, task)
    assert found.controller == kind
    worlds = page["Worlds"](task, found.network, 1)
    worlds.seed(3)
    seen, view, memory = worlds.reset(), SensorView(), [0.0] * found.network.memory
    outputs = []
    for _ in range(200):
        view.proximity = list(seen[0][:8] * 4095.0)
        found.network.function(view, found.parameters, memory)
        seen, _, _, _ = worlds.step(model.predict(seen, deterministic=True)[0])
        outputs.append(worlds.outputs[0])
        assert np.array([view.left, view.right]) * METRES_PER_STEP / 0.1 == pytest.approx(outputs[-1], abs=1e-5)
    assert len(np.unique(outputs, axis=0)) > 100  # it does not always decide the same
