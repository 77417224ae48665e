"""Figures of the elastic arm: frames for the kinds of figures of the kit."""

from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.elastic_arm.parts.gauges import FREE_OF_NOISE, NOISY
from flexik.cases.elastic_arm.parts.readings import ANGLES, HELD_OUT
from flexik.cases.elastic_arm.report_results import R, Results
from flexik.reporting import kinds, plane, style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import DEGREES, MICRO, MM

# Least 1 - R that is drawn: nothing less differs from zero by rounding
ROUND_OFF = float(np.finfo(np.float64).eps)
PAIRS = {
    **{name: Axis(f"{name} (deg)", DEGREES) for name in ANGLES},
    **{name: Axis(f"{name} (m)") for name in ("p_x", "p_y")},
}
LOOKS = {"training and selection": {"color": style.SKY}, "held out": {"color": style.VERMILION}}


def figures(results: Results) -> dict[str, Drawing]:
    """All figures by name."""
    frames = results.errors.items()
    errors = pd.concat([frame.assign(method=label) for label, frame in frames])
    # the first method of every kind, but not no compensation
    first = {m.method: label for label, m in reversed(results.section.methods.items())}
    shown = errors[errors["method"].isin([first[kind] for kind in first if kind != "none"])]
    error, place = Axis("error (mm)", MM, log=True), ("target_x", "target_y", "error", "method")
    distribution = draw(kinds.distribution, errors, "error", "method", error, what="targets")
    return {
        **{f"deformation_link_{link}": deformation(results, link) for link in (1, 2)},
        **{
            f"target_and_network_{name}": target_and_network(results, name)
            for name in shown_networks(results)
        },
        "network_comparison": network_comparison(results),
        "error_distribution": distribution,
        "error_over_targets": draw(plane.maps, shown, *place, label="error (mm)", scale=MM),
    }


def shown_networks(results: Results) -> list[str]:
    """Networks whose values are published, or the first one."""
    published = results.fits[f"published_{R[0]}"].notna()
    return [str(name) for name in results.fits.index[published]] or [results.main]


def deformation(results: Results, link: int) -> Drawing:
    """Deformation of `link` against theta_2 by payload at the steepest theta_1.

    After figures 8 to 13 of the paper: lines of the model and dots of the gauges with noise; dx by
    the gauges, which is far less than the model's, in a panel of its own, there lines of the gauges
    without noise.
    """
    # at 0 no force acts along link 1
    readings = results.readings
    rows = np.isclose(readings["theta_1"], readings["theta_1"].max())
    readings = readings[rows]
    exact, noisy = (results.shown(noise)[rows] for noise in (FREE_OF_NOISE, NOISY))
    dx, dy, dphi = (f"{name}_{link}" for name in ("dx", "dy", "dphi"))
    panels: dict[str, dict[str, Any]] = {
        "dx of the model": {"axis": Axis("dx (mm)", MM), "lines": readings[dx]},
        "dx by the gauges": {"axis": Axis("dx (um)", MICRO), "lines": exact[dx], "dots": noisy[dx]},
        "dy": {"axis": Axis("dy (mm)", MM), "lines": readings[dy], "dots": noisy[dy]},
        "dphi": {"axis": Axis("dphi (mrad)", MM), "lines": readings[dphi], "dots": noisy[dphi]},
    }
    pose = readings[["theta_2", "payload"]]
    lines, dots = (
        pd.concat(pose.assign(value=of[k], panel=panel) for panel, of in panels.items() if k in of)
        for k in ("lines", "dots")
    )
    return draw(
        chart,
        Layer(lines, "theta_2", "value", "-", "payload", label="{:g} kg"),
        Layer(dots, "theta_2", "value", ".", "payload", label="", look={"markersize": 3.5}),
        x=Axis("theta_2 (deg)", DEGREES),
        y={panel: of["axis"] for panel, of in panels.items()},
        panel="panel",
        columns=2,
        looks=style.shades(readings["payload"]),
        legend="model, or gauges without noise (lines), gauges with noise (dots)",
    )


def target_and_network(results: Results, name: str) -> Drawing:
    """Angles and tip by a network against their targets (after figures 15 to 18 of the paper)."""
    table = results.joined(name)
    published = results.fits.loc[name, [f"published_{r}" for r in R]].set_axis(ANGLES)
    held_out = table["part"] == HELD_OUT
    frames, titles = [], {}
    for quantity in PAIRS:
        pair = table[[quantity, f"network_{quantity}"]].set_axis(["target", "network"], axis=1)
        part = np.where(held_out, "held out", "training and selection")
        frames.append(pair.assign(quantity=quantity, part=part))
        r = float(pair[held_out].corr().to_numpy()[0, 1])
        titles[quantity] = f"{quantity}: R = {r:.6f}"
        if np.isfinite(published.get(quantity, np.nan)):
            titles[quantity] += f" (published {published[quantity]:.6f})"
    every = pd.concat(frames).sort_values("part", ascending=False, kind="stable")
    line = every.assign(network=every["target"])
    return draw(
        chart,
        Layer(line, "target", "network", look={"color": style.INK, "linewidth": 0.8}),
        Layer(every, "target", "network", "o", "part", look={"markersize": 3.2}),
        looks=LOOKS,
        x={k: Axis(f"target {axis.label}", axis.scale) for k, axis in PAIRS.items()},
        y={k: Axis(f"network {axis.label}", axis.scale) for k, axis in PAIRS.items()},
        titles=titles,
        panel="quantity",
        columns=2,
        height=7.2,
    )


def network_comparison(results: Results) -> Drawing:
    """One minus R of both angles on held-out readings by network (after figures 19 to 22)."""
    fits = results.fits
    names = [f"{name} ({hidden})" for name, hidden in fits["hidden"].items()]
    columns = {r: {"ours": 1.0 - fits[r], "published": 1.0 - fits[f"published_{r}"]} for r in R}
    rows = [
        pd.DataFrame({"network": names, "angle": angle, **columns[r]})
        for angle, r in zip(ANGLES, R, strict=True)
    ]
    label = "1 \N{MINUS SIGN} R on held-out readings (less is better)"
    x = Axis(label, log=True, least=ROUND_OFF)
    names_of = ("network", "ours", "published", x)
    return draw(kinds.beside, pd.concat(rows), *names_of, hue="angle", numbers="")
