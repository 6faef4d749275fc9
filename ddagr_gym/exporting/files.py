"""Names of what an export writes."""

MUJOCO, GAZEBO, RANDOMISATION = "mujoco", "gazebo", "randomisation"
FORMATS = (MUJOCO, GAZEBO, RANDOMISATION)

MUJOCO_FILE = "robot.xml"
GAZEBO_FILE = "model.sdf"
GAZEBO_CONFIG = "model.config"
RANDOMISATION_FILE = "randomisation.yaml"
PAGE = "index.html"
