"""Fitting a simulator to recordings: windows, residuals, uncertain parameters and priors, Gauss-Newton, noise."""
