"""What changed against a robot's ordinary drives: shifts of estimates instead of gains of likelihood.

    ordinary -> drive_fit -> drive_scan -> reference -> sizes -> between_drives -> shifts -> naming -> conclusion

The size of every effect is estimated jointly with what differs between ordinary drives (robot, soil, biases, with the
scatter of a calibration as their prior), to first order about the refitted calibrated robot. The same estimate on every
ordinary drive, with a robot that was calibrated without it, says what a wrong simulator does to it; a shift counts in
standard deviations of both (the local approach: A. Benveniste, M. Basseville, G. Moustakides, IEEE TAC 32 (1987) 583).
"""
