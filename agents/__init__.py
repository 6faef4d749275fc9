"""Training of learned policies with Stable-Baselines3; run from the checkout by ``./ddagr train``.

What training makes is read by :mod:`ddagr_gym.policies`, which needs neither torch nor this folder.
"""
