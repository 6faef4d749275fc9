"""What others' environments cost on this machine: MuJoCo's Ant and a four-wheel skid-steer on rigid ground."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

SKID_STEER = """
<mujoco model="skid_steer">
  <option timestep="{step}" integrator="implicitfast"/>
  <worldbody>
    <geom name="ground" type="plane" size="50 50 1" friction="0.8 0.01 0.001"/>
    <body name="robot" pos="0 0 0.4">
      <freejoint/>
      <inertial pos="0 0 0" mass="148" diaginertia="55 55 90"/>
      <geom type="box" size="0.5 0.4 0.1" contype="0" conaffinity="0"/>
      {wheels}
    </body>
  </worldbody>
  <actuator>{motors}</actuator>
</mujoco>
"""

WHEEL = """
<body name="wheel_{name}" pos="{x} {y} -0.1">
  <joint name="hinge_{name}" type="hinge" axis="0 1 0"/>
  <geom type="cylinder" size="0.28 0.1" euler="90 0 0" mass="5" friction="0.8 0.01 0.001"/>
</body>
"""


def skid_steer_steps(step: float = 0.002) -> Callable[[], object] | None:
    """One control interval of 80 ms of the rigid-ground skid-steer (DDAGR's size), or None without MuJoCo."""
    try:
        import mujoco
    except ImportError:
        return None
    corners = {"1": (0.33, -0.58), "2": (0.33, 0.58), "3": (-0.33, -0.58), "4": (-0.33, 0.58)}
    wheels = "".join(WHEEL.format(name=name, x=x, y=y) for name, (x, y) in corners.items())
    motors = "".join(f'<velocity joint="hinge_{name}" kv="200"/>' for name in corners)
    model = mujoco.MjModel.from_xml_string(SKID_STEER.format(step=step, wheels=wheels, motors=motors))
    data = mujoco.MjData(model)
    count = round(0.08 / step)

    def interval() -> object:
        data.ctrl[:] = (1.4, 0.1, 1.4, 0.1)
        for _ in range(count):
            mujoco.mj_step(model, data)
        return data.qpos

    return interval


def ant_step() -> Callable[[], object] | None:
    """One step of Ant-v5, or None without MuJoCo."""
    import gymnasium

    try:
        env = gymnasium.make("Ant-v5")
    except (ImportError, gymnasium.error.Error):
        return None
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (64, 8)).astype(np.float32)
    state = {"n": 0}

    def step() -> object:
        state["n"] += 1
        result = env.step(actions[state["n"] % 64])
        if result[2] or result[3]:
            env.reset()
        return result

    return step
