"""One exported bench in mjlab, run by mjlab's own Python, which has nothing of this project.

python mjlab_world.py EXPORT       (a folder with bench.xml, servo_cfg.py and asked.json)
"""

import json
import runpy
import sys
from pathlib import Path

import mujoco
import numpy as np
import torch
from mjlab.entity import EntityArticulationInfoCfg, EntityCfg  # pyright: ignore
from mjlab.scene import Scene, SceneCfg  # pyright: ignore
from mjlab.sim.sim import MujocoCfg, Simulation, SimulationCfg  # pyright: ignore

NAME, DEVICE = "bench", "cpu"


def main(folder: Path) -> None:
    """Follow targets that are each held for some steps, and write the tendon's lengths [m]."""
    asked = json.loads((folder / "asked.json").read_text(encoding="utf-8"))
    actuators = runpy.run_path(str(folder / "servo_cfg.py"))["ACTUATORS"]
    bench = EntityCfg(
        spec_fn=lambda: mujoco.MjSpec.from_file(str(folder / "bench.xml")),  # pyright: ignore
        articulation=EntityArticulationInfoCfg(actuators=tuple(actuators.values())),
    )
    scene = Scene(SceneCfg(num_envs=1, entities={NAME: bench}), DEVICE)
    options = MujocoCfg(timestep=asked["step"], gravity=tuple(asked["gravity"]))
    simulation = Simulation(1, SimulationCfg(mujoco=options), scene.compile(), DEVICE)
    scene.initialize(simulation.mj_model, simulation.model, simulation.data)
    simulation.reset()
    joints = torch.tensor([asked["joints"]], dtype=torch.float32)
    scene[NAME].write_joint_state_to_sim(joints, torch.zeros_like(joints))
    lengths = []
    for target in asked["targets"]:
        scene[NAME].set_tendon_len_target(torch.tensor([[target]], dtype=torch.float32))
        simulation.forward()
        lengths.append(float(simulation.data.ten_length[0, 0]))
        for _ in range(asked["count"]):
            scene.write_data_to_sim()
            simulation.step()
            scene.update(asked["step"])
    np.savetxt(folder / "lengths.csv", lengths)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
