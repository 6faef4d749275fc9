"""Speed loop of a wheel bank, with what a real motor and its controller cannot give."""

from __future__ import annotations

from .jit import kernel

SLOWEST_TURN = 0.05
"""Speed below which a motor's power limit no longer raises its torque [rad/s]."""
LEAST_SHARE = 0.1
"""Of the torque limit that folding back leaves [-]."""


@kernel
def torque_ceiling(motors, omega, fade):  # type: ignore[no-untyped-def]
    """Most torque of a bank [N m] that turns at ``omega`` [rad/s], (driving, braking): power limits driving only."""
    ceiling = motors.torque_limit * fade
    if motors.fold_back > 0.0:
        ceiling *= max(1.0 - motors.fold_back * abs(omega), LEAST_SHARE)
    driving = ceiling
    if motors.power_limit > 0.0:
        driving = min(ceiling, motors.power_limit / max(abs(omega), SLOWEST_TURN))
    return driving, ceiling


@kernel
def held_integral(motors, integral, wound):  # type: ignore[no-untyped-def]
    """Integral of the speed error, held where its torque ``integral * wound`` meets a limit of its own."""
    if motors.integral_limit > 0.0:
        most = motors.integral_limit / integral
        return min(max(wound, -most), most)
    return wound


@kernel
def motor_step(motors, drives, bank, command, omega, power, time, dt):  # type: ignore[no-untyped-def]
    """Advance one speed loop; return (torque, its derivative by bank speed)."""
    state = drives[bank]
    fade = max(1.0 - motors.fading * time, 0.1)
    rate = (motors.rate_up if abs(command) > abs(state[0]) else motors.rate_down) * fade
    state[0] += dt * rate * (command - state[0]) / (1.0 + dt * rate)
    wanted = state[0]
    if motors.second_lag > 0.0:
        wanted = state[1] + dt * (state[0] - state[1]) / (motors.second_lag + dt)
    limit = max(motors.speed_limit - motors.load_line * abs(state[4]), 0.05)
    wanted = min(max(wanted, -limit), limit)
    acceleration, state[1] = (wanted - state[1]) / dt, wanted
    moved = motors.inertia + motors.carried_inertia
    proportional = 2.0 * motors.damping * motors.bandwidth * moved
    integral = motors.bandwidth**2 * moved
    leak = integral * motors.droop / (1.0 - min(proportional * motors.droop, 0.95))
    error = wanted * (1.0 - motors.sag * power) - omega
    torque = moved * acceleration + proportional * error + integral * state[2]
    driving, braking = torque_ceiling(motors, omega, fade)
    ceiling = driving if torque * omega > 0.0 else braking
    if abs(torque) < ceiling:
        state[2] = held_integral(motors, integral, (state[2] + dt * error) / (1.0 + dt * leak))
    torque = min(max(torque, -ceiling), ceiling)
    state[3] = torque
    state[4] += dt / 0.25 * (torque - state[4])
    return torque, -proportional if abs(torque) < ceiling else 0.0
