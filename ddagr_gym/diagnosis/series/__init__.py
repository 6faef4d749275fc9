"""Many drives of one robot over time, each against its calibration.

``one_drive`` answers for a drive, ``size_points`` takes from that what is followed over time, ``control_chart`` holds
it against limits, ``change_points`` finds the drives at which it changed, ``conclusion`` and ``sentences`` say so.
"""
