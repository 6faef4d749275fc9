"""What stands between command and wheel on real robots: ``python -m benchmarks.drivetrain``.

A stand-alone model of a drivetrain with a simple load in the place of the terrain, fitted to the commands and encoders
of real drives. It shows which parts the data ask for; the simulator's drivetrain is another piece of code.
"""
