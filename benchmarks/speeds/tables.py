"""The results as plain text."""

from __future__ import annotations

from typing import Any

from ddagr_gym.commands.output import format_table


def tables_of(results: dict[str, Any]) -> str:
    """All tables of ``benchmarks.speed.measure``'s results."""
    parts = [
        _steps(results["steps_per_second"]),
        _batch(results["batch"]),
        _two_threads(results["two_threads"]),
        _share(results["kernel_share"]),
        _kernel(results["kernel_beside_c"]),
        _quadrature(results["quadrature"]),
        _time_step(results["time_step"]),
        _memory(results["memory"]),
    ]
    return "\n\n".join(parts)


def _steps(steps: dict[str, Any]) -> str:
    ratios = {found["to"]: found["median"] for found in steps["ratios"]}
    rows = [
        (name, rate["median"], *rate["quartiles"], steps["simulated_seconds_per_second"][name], ratios.get(name, "-"))
        for name, rate in steps["rates"].items()
    ]
    header = ("environment", "steps/s", "from", "to", "simulated s/s", "row turn's steps/s over this")
    text = "One environment through gym.make, one core, resets included\n" + format_table(header, rows)
    return f"{text}\n{steps['skipped']}" if "skipped" in steps else text


def _batch(batch: dict[str, list[dict[str, Any]]]) -> str:
    rows = [
        (
            workload, row["environments"], row["one_thread"]["median"], *row["one_thread"]["quartiles"],
            row["two_threads"]["median"], row["gain_of_two"]["median"], row["two_threads"]["cpu_over_wall"],
            row["cpu_seconds_of_one_over_two"]["median"],
        )
        for workload, found in batch.items()
        for row in found
    ]  # fmt: skip
    header = (
        "workload",
        "environments",
        "simulated s/s",
        "from",
        "to",
        "two threads (wall)",
        "gain",
        "cores got",
        "CPU of one over two",
    )
    return "Native batch, resets included\n" + format_table(header, rows)


def _two_threads(found: list[dict[str, Any]]) -> str:
    rows = [
        (row["workload"], row["environments"], *_of_gain(row["gain"]), f"{row['turns']} of {row['all_turns']}",
         row["gain_of_all_turns"]["median"], row["second_core"]["median"])
        for row in found
    ]  # fmt: skip
    header = (
        "workload", "environments", "two threads over one", "from", "to", "turns with two free cores", "in all turns",
        "second core",
    )  # fmt: skip
    return "Native batch between resets\n" + format_table(header, rows)


def _of_gain(gain: dict[str, Any] | None) -> tuple[Any, ...]:
    return ("-", "-", "-") if gain is None else (gain["median"], *gain["quartiles"])


def _share(shares: dict[str, dict[str, float]]) -> str:
    header = ("workload", "us per 8 ms", "force evaluations", "for the derivative", "share in the kernel")
    keys = (
        "microseconds_per_sample",
        "force_evaluations_per_sample",
        "derivative_evaluations_per_sample",
        "share_in_kernel",
    )
    rows = [(name, *(found[key] for key in keys)) for name, found in shares.items()]
    return "One robot in the simulator, without the environment\n" + format_table(header, rows)


def _kernel(beside: dict[str, Any]) -> str:
    if "skipped" in beside:
        return f"Contact kernel beside C: left out, {beside['skipped']}"
    rows = [("ours", beside["nanoseconds"]["ours"], beside["nanoseconds"]["ours"] / beside["nodes"], 1.0)]
    rows += [
        (found["of"], beside["nanoseconds"][found["of"]], beside["nanoseconds"][found["of"]] / beside["nodes"],
         found["median"])
        for found in beside["time_ratios"]
    ]  # fmt: skip
    header = ("contact kernel", "ns", "ns per node", "our time over this")
    return f"{beside['compiler']}, {' '.join(beside['flags'])}\n" + format_table(header, rows)


def _quadrature(rows: list[dict[str, Any]]) -> str:
    keys = ("section_nodes", "contact_nodes", "nanoseconds", "median_error", "error_of_9_in_10", "largest_error")
    header = ("across", "along each half", "ns", "median error", "nine in ten", "largest", "")
    marked = [(*(row[key] for key in keys), "default" if row["default"] else "") for row in rows]
    return f"Quadrature: force error over force, {rows[0]['states']} states on all soils\n" + format_table(
        header, marked
    )


def _time_step(workloads: dict[str, list[dict[str, Any]]]) -> str:
    rows = [
        (workload, row["numerics"], row["microseconds"], row["v_x"], row["v_y"], row["yaw_rate"])
        for workload, found in workloads.items()
        for row in found
    ]
    header = ("workload", "numerics", "us per 8 ms", "v_x [m/s]", "v_y [m/s]", "yaw rate [rad/s]")
    return "Time step: r.m.s. errors against converged steps\n" + format_table(header, rows)


def _memory(found: dict[str, Any]) -> str:
    if "skipped" in found:
        return f"Memory: left out, {found['skipped']}"
    verdict = "flat" if found["flat"] else "NOT flat"
    return (
        f"Memory over {found['resets']:,} resets: {found['growth_mebibytes']:+.2f} MiB ({verdict}), "
        f"{found['resident_mebibytes'][-1]:.0f} MiB resident; "
        f"{found['milliseconds_per_reset_and_two_steps']:.2f} ms per reset and two steps."
    )
