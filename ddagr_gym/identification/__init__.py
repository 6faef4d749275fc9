"""Fitting the simulator to recordings: one engine for replay, diagnosis and calibration.

Reading order, each module using those before it::

    timing_repair    recordings made even: short joins bridged, late poses moved to their own time
    windows          cut into windows of equal length; data_split says which of them a fit may see
    signals, noise   standard deviation of every reading; recording_noise adds lateness of poses and bias of the gyro
    block_means      residuals: samples or means over blocks, each over its standard deviation
    parameters       what is uncertain, shared by all recordings or own to some; nuisances and headings choose for a fit
    fit_numerics     accuracy of the simulator inside a fit
    motor_currents   what motor currents measure, up to unknown constants
    window_model     the simulator over windows: predictions and their derivatives
    least_squares    the linearised problem: elimination, robust weights, bounded step, deviations
    reading_effects  what effects of the sensors make of a bias
    problem          residuals, sensitivities and local unknowns of one fit
    effect_parameters, size_prior    assumed missing physics as parameters
    gauss_newton     the iteration
    misfit           what a fit leaves of each channel

Words
-----
window
    A piece of a recording, simulated on its own from an initial state that is fitted with it. Windows share nothing but
    the parameters, so that errors do not add up over a drive.
residual
    Measured less predicted, of a sample or of a block's mean, over its standard deviation: about 1 where the model is
    right (:meth:`~ddagr_gym.identification.block_means.BlockedWindows.residual`).
nuisance
    A parameter of the nominal model that is uncertain without being of interest: soil, robot, sensor biases, the time
    at which commands act. It has a prior and a *scope*: all recordings, or a group of them
    (:class:`~ddagr_gym.identification.parameters.ModelParameter`).
prior
    What is known of an unknown before the data: a normal distribution, whose standard deviation says how far it may go
    at what cost.
local unknown
    What a window has of its own: its initial state, and in a diagnosis its soil, its relief and the wandering of its
    gyro. Local unknowns are eliminated linearly, so that what they could explain counts for nothing
    (:class:`~ddagr_gym.identification.nuisances.LocalUnknown`).

Equations
---------
Cost, elimination, normal equations, bounded step, robust loss and both kinds of deviations are equations (1) to (6) of
:mod:`~ddagr_gym.identification.least_squares`; the cost that a step must lower is defined in
:mod:`~ddagr_gym.identification.gauss_newton`, noise of block means in
:meth:`~ddagr_gym.identification.noise.ChannelNoise.of_mean`.

A fit over many drives
----------------------
Recordings of one sample period are cut together; ``WindowSet.recording`` says where each window comes from. Shared and
own parameters stand in one list::

    uncertain = Nuisances((motor_rate, *per_group(soil_strength, {"sand": (0, 1), "grass": (2, 3)})))
    problem = Problem(robot, soil, sample_windows(windows, sigma), uncertain)
    fitted = fit(problem)
    deviation, by_window = linearised(problem, fitted).deviations()

The cost of the derivatives does not grow with the number of groups: one simulation serves all parameters whose scopes
do not overlap.
"""
