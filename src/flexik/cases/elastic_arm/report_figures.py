"""Figures of the elastic arm: frames for the kinds of figures of the kit."""

import numpy as np
import pandas as pd

from flexik.cases.elastic_arm.parts.gauges import FREE_OF_NOISE, NOISY
from flexik.cases.elastic_arm.parts.readings import ANGLES, HELD_OUT
from flexik.cases.elastic_arm.report_results import R, Results
from flexik.cases.elastic_arm.report_results import of as table_of
from flexik.evaluation.regression import correlation
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


def figures(results: Results) -> dict[str, Drawing]:
    """All figures by name."""
    frames = results.errors.items()
    errors = pd.concat([frame.assign(method=label) for label, frame in frames])
    looks = style.looks(results.errors)
    shown = [label for label in results.errors if label not in hidden_methods(results)]
    return {
        **{f"deformation_link_{link}": deformation(results, link) for link in (1, 2)},
        **{
            f"target_and_network_{name}": target_and_network(results, name)
            for name in shown_networks(results)
        },
        "network_comparison": network_comparison(results),
        "error_distribution": draw(
            kinds.distribution,
            errors,
            "error",
            "method",
            Axis("error (mm)", MM, log=True),
            what="targets",
            looks=looks,
        ),
        "error_over_targets": draw(
            plane.maps,
            errors[errors["method"].isin(shown)],
            "target_x",
            "target_y",
            "error",
            "method",
            label="error (mm)",
            scale=MM,
        ),
    }


def shown_networks(results: Results) -> list[str]:
    """Networks whose values are published, or the first one."""
    published = results.fits[f"published_{R[0]}"].notna()
    return [str(name) for name in results.fits.index[published]] or [results.main]


def hidden_methods(results: Results) -> list[str]:
    """All but the first method of every kind, and no compensation."""
    kinds_of = {label: method.method for label, method in results.section.methods.items()}
    first = {kind: label for label, kind in reversed(kinds_of.items())}
    return [label for label, kind in kinds_of.items() if kind == "none" or first[kind] != label]


def deformation(results: Results, link: int) -> Drawing:
    """Deformation of `link` against theta_2 by payload at the steepest theta_1.

    After figures 8 to 13 of the paper: lines of the model and dots of the gauges with noise; dx by
    the gauges, which is far less than the model's, in a panel of its own, there lines of the gauges
    without noise.
    """
    # at 0 no force acts along link 1
    readings = table_of("samples/readings")
    rows = np.isclose(readings["theta_1"], readings["theta_1"].max())
    readings = readings[rows]
    exact, noisy = (results.shown(noise)[rows] for noise in (FREE_OF_NOISE, NOISY))
    dx, dy, dphi = (f"{name}_{link}" for name in ("dx", "dy", "dphi"))
    panels: dict[str, tuple[Axis, pd.Series, pd.Series | None]] = {
        "dx of the model": (Axis("dx (mm)", MM), readings[dx], None),
        "dx by the gauges": (Axis("dx (um)", MICRO), exact[dx], noisy[dx]),
        "dy": (Axis("dy (mm)", MM), readings[dy], noisy[dy]),
        "dphi": (Axis("dphi (mrad)", MM), readings[dphi], noisy[dphi]),
    }

    pose = readings[["theta_2", "payload"]]
    lines = [pose.assign(value=of[1], panel=panel) for panel, of in panels.items()]
    dots = [
        pose.assign(value=of[2], panel=panel) for panel, of in panels.items() if of[2] is not None
    ]
    return draw(
        chart,
        Layer(pd.concat(lines), "theta_2", "value", "-", "payload", label="{:g} kg"),
        Layer(
            *(pd.concat(dots), "theta_2", "value", ".", "payload"),
            label="",
            look={"markersize": 3.5},
        ),
        x=Axis("theta_2 (deg)", DEGREES),
        y={panel: of[0] for panel, of in panels.items()},
        panel="panel",
        columns=2,
        share="x",
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
        pair = table[[quantity, f"network_{quantity}"]]
        frames.append(pair.set_axis(["target", "network"], axis=1).assign(quantity=quantity))
        r = correlation(*(pair[held_out].to_numpy()[:, [k]] for k in (0, 1)))[0]
        titles[quantity] = f"{quantity}: R = {r:.6f}"
        if np.isfinite(published.get(quantity, np.nan)):
            titles[quantity] += f" (published {published[quantity]:.6f})"
    every = pd.concat(frames).reset_index(drop=True)
    of_held_out = np.tile(held_out.to_numpy(), len(PAIRS))
    ends = every.groupby("quantity", sort=False)["target"].agg(["min", "max"])
    line = ends.reset_index().melt("quantity", value_name="target")
    line["network"] = line["target"]
    return draw(
        chart,
        Layer(line, "target", "network", look={"color": style.INK, "linewidth": 0.8}),
        Layer(
            *(every[~of_held_out], "target", "network", "o"),
            label="training and selection",
            look={"color": style.SKY, "markersize": 3.0},
        ),
        Layer(
            *(every[of_held_out], "target", "network", "o"),
            label="held out",
            look={"color": style.VERMILION, "markersize": 3.6},
        ),
        x={k: Axis(f"target {axis.label}", axis.scale) for k, axis in PAIRS.items()},
        y={k: Axis(f"network {axis.label}", axis.scale) for k, axis in PAIRS.items()},
        panel="quantity",
        titles=titles,
        columns=2,
        share="",
        height=7.2,
    )


def network_comparison(results: Results) -> Drawing:
    """One minus R of both angles on held-out readings by network (after figures 19 to 22)."""
    fits = results.fits
    rows = [
        pd.DataFrame(
            {
                "network": [f"{name} ({hidden})" for name, hidden in fits["hidden"].items()],
                "angle": angle,
                "ours": 1.0 - fits[r],
                "published": 1.0 - fits[f"published_{r}"],
            }
        )
        for angle, r in zip(ANGLES, R, strict=True)
    ]
    return draw(
        kinds.beside,
        pd.concat(rows),
        "network",
        "ours",
        "published",
        Axis("1 \N{MINUS SIGN} R on held-out readings (less is better)", log=True, least=ROUND_OFF),
        hue="angle",
        numbers="",
    )
