"""Which physics a nominal simulator leaves out, from recordings: where, what, how big, how sure, what else.

    recordings -> data_checks -> held -> noise -> windows (setting, blocks) -> problem -> refit -> scores -> search
               -> verdict -> certify (forecast, residual_model, certificate) -> localisation -> unnamed -> next_drive
               -> evidence

*pipeline* runs these steps, *store* keeps what is finished, *inputs* says what recordings need to have.

Method (measured reasons in the study that the project follows)
    *data_checks* clocks, signs, units and dead channels, as `ddagr check` judges them, before any physics.
    *noise*       level, growth with speed and colour of each channel from the recordings alone.
    *held*        repeated readings, found in the values; repeats count as missing samples afterwards. *flipped*: a
                  reversed gyro, found and mended in the same way, because first guesses come from its readings.
    *prepared*    both, for diagnoses and banks of given drives alike.
    *blocks*      windows as means over 0.1 s. The error of the nominal speed loop adds to their noise.
    *nuisance*    what is uncertain about soil, robot, biases and clocks, as global parameters with priors, and how the
                  field differs from window to window, as local ones. Initial states and local parameters are eliminated
                  from every sensitivity by a QR factorisation per window.
    *headings*    recordings without poses have a heading of their own; dead reckoning ties their windows.
    *refit*       Gauss-Newton with priors and bounds; jointly with any effect that is assumed.
    *scores*      one simulation per probe of the library; from inner products per window follow gains (fall of the
                  cost), cluster-robust scores, gains on left-out windows and resampled gains without another one.
    *overlap*     how much of an effect lies where named ones act; what acts elsewhere is no rest of them.
    *reread*      effects that act on readings only need no simulation of their own.
    *null_bank*   the same scan of drives from structurally different simulators (over *standard_drives* or given ones),
                  or of real drives that were ordinary; *thresholds* are its quantiles, with margins for strangers.
                  Worlds are drawn about the nominal robot and soil, or, for a bank of given recordings, about those
                  fitted to them (*fitted_nominal*, a parametric bootstrap).
                  They know how long its windows were, and a diagnosis cuts recordings in the same way: 6 s for the
                  DDAGR, in which side forces and drags show two to four times as much as in 2 s and null drives hardly
                  more; in 12 s the structure of the simulator shows as much as what is missing.
    *misfit*      what is left by channel, and of what the local variations have to make up for.
    *equivalence* rivals whose joint refits are nearly as good, weighted over resampled windows.
    *search*      forward and backward moves over joint refits, each through the gate; *hypotheses* says where they
                  begin, *equivalent* adds rivals that no scan finds, *standing* is what a search holds.
    *certify*     sizes fitted to the other recordings predict each one from states known at the start, over 1, 5 and
                  30 s; a flexible model of what is left says how much could have been explained.

Why a refit has two starts: where something large is missing, the nominal refit bends soil and robot to make up for it,
up to places from which no small step leads back; a joint refit from the raw nominal model finds the truth there.

Limits so far
    *Which* effects are named is decided on all recordings; only their sizes are certified on others. ``complete``
    and ``unknown`` rest on the misfit per channel against the null bank. Mass hides behind soil strength in drives of
    this kind, and so does a drag along the speed: see ``detectable``. Which of two motor poles is the slower one is
    open, so that the lag of a second pole is shared out with the nuisance ``motor_rate``. Without poses the headings
    of several recordings are found where a slope shows them; a patch that they share is looked for as if they had
    begun at one place.

Conventions: SI units, radians, channels and states in the order of :mod:`ddagr_gym.identification.windows`.
Costs are half sums of squares in units of the noise; gains are divided by the dispersion of the model they start from.
"""
