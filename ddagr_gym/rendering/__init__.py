"""Drawing a robot on its ground: the scenes of the environments and of videos."""
