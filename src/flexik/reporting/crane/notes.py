"""Sentences of the crane's report that follow from its parameters and results."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from flexik.parameters import CombinedModel, InvertedModel, MethodModel
from flexik.positioning.method import REACHED, STATUS_MEANING
from flexik.reporting.style import MM, coordinates

THESIS_POINTS = 25
STAND_IN = (2.0, -3.95)
GA_DIAGNOSTIC = "corrected_n_generations"
CALIBRATION_TARGET = 10.0  # %, accepted difference from the published


def methods_text(methods: Mapping[str, MethodModel]) -> str:
    """What each method does, a list in Markdown, and what limits the genetic ones."""
    lines = ["- `none`: rigid inverse kinematics alone, in closed form."]
    lines += [f"- `{label}`: {_method_text(method)}" for label, method in methods.items()]
    floors = [
        f"`{label}`: {MM * method.genetic.tolerance:g} mm"
        for label, method in methods.items()
        if isinstance(method, CombinedModel) and method.genetic is not None
    ]
    text = "\n".join(lines)
    if floors:
        text += (
            "\n\nThe genetic inverse stops as soon as the rigid tip is within its tolerance "
            f"({', '.join(floors)}) and so sets its own floor."
        )
    return text


def _method_text(method: MethodModel) -> str:
    network = f"network `{method.network}`"
    if isinstance(method, CombinedModel):
        inverse = {"closed_form": "in closed form", "genetic": "by the thesis' genetic algorithm"}
        return (
            f"rigid inverse, deflection by the {network}, corrected target, rigid inverse again "
            f"(corrections: {method.n_corrections}); inverses {inverse[method.inverse]}."
        )
    if isinstance(method, InvertedModel):
        search = {"gradient_descent": "gradient descent", "gauss_newton": "damped Gauss-Newton"}
        joined = " (rigid network and correction, joined)" if method.method == "modular" else ""
        return (
            f"{network} of the tip{joined}, inverted by {search[method.inversion.kind]} on its "
            f"inputs to a tolerance of {method.inversion.tolerance:g}, within the stroke limits."
        )
    return f"{network} of lift and jib stroke; extension by the rule of appendix B."


def point_notes(points: Sequence[tuple[float, float]]) -> list[str]:
    """What to know about the test points beside the published values."""
    notes = []
    if len(points) == THESIS_POINTS:
        notes.append(
            f"The thesis' figure with its {THESIS_POINTS} points is lost: its text names six of "
            "them, the others here fill the reach evenly (params.yaml). Single maxima depend on "
            "the points."
        )
    if STAND_IN in points:
        notes.append(
            "(2, -3.95) stands in for the thesis' point (2, -4), which the loaded crane cannot "
            "reach."
        )
    return notes


def worse_notes(frames: Mapping[str, pd.DataFrame]) -> list[str]:
    """In how many conditions each method does worse than `none`, another of `frames`."""
    notes = []
    for label, frame in frames.items():
        if label == "none":
            continue
        excess = frame["error"].to_numpy() - frames["none"]["error"].to_numpy()
        most = f", by at most {MM * excess.max():.1f} mm" if (excess > 0).any() else ""
        notes.append(
            f"{label}: worse than no compensation in {(excess > 0).sum()} of {len(frame)} "
            f"conditions{most}."
        )
    return notes


def extrapolation_notes(payload: pd.Series, trained: pd.Series) -> list[str]:
    """How many conditions carry a `payload` outside the range of the `trained` ones, kg."""
    low, high = trained.min(), trained.max()
    outside = int((~payload.between(low, high)).sum())
    if not outside:
        return []
    return [
        f"Payload outside the training grid's {low:g} to {high:g} kg, extrapolated by the "
        f"networks: {outside} of {len(payload)} conditions."
    ]


def failure_notes(frames: Mapping[str, pd.DataFrame]) -> list[str]:
    """How many conditions each method failed in, and why."""
    notes = []
    for label, frame in frames.items():
        failed = frame["status"].to_numpy()[frame["status"] != REACHED]
        if not failed.size:
            continue
        codes, numbers = np.unique(failed, return_counts=True)
        reasons = "; ".join(
            f"{STATUS_MEANING[int(code)]}: {n}" for code, n in zip(codes, numbers, strict=True)
        )
        notes.append(
            f"{label}: failed conditions: {failed.size} ({reasons}); their errors are at the "
            "strokes where the method stopped and are included."
        )
    return notes


def genetic_notes(frames: Mapping[str, pd.DataFrame]) -> list[str]:
    """How long the genetic inverses searched."""
    return [
        f"{label}: the genetic inverse of the corrected target took "
        f"{frame[GA_DIAGNOSTIC].mean():.0f} generations on average, "
        f"{frame[GA_DIAGNOSTIC].max()} at most."
        for label, frame in frames.items()
        if GA_DIAGNOSTIC in frame
    ]


def calibration_notes(table: pd.DataFrame) -> list[str]:
    """Entries of a tables.calibration_table that miss CALIBRATION_TARGET."""
    far = table[~(np.abs(table["difference (%)"]) <= CALIBRATION_TARGET)]
    if far.empty:
        return [f"No entry differs from the published one by more than {CALIBRATION_TARGET:g} %."]
    entries = ", ".join(
        f"{name} by {difference:+.1f} %"
        for name, difference in zip(far["statistic"], far["difference (%)"], strict=True)
    )
    return [f"More than {CALIBRATION_TARGET:g} % from the published one: {entries}."]


def worst_point_notes(frame: pd.DataFrame) -> list[str]:
    """Where the largest error is, and how much it owes to one test point."""
    worst = frame.iloc[int(frame["error"].to_numpy().argmax())]
    others = frame.loc[frame["point"] != worst["point"], "error"]
    if others.empty:
        return []
    point = coordinates(worst["target_x"], worst["target_y"])
    return [
        f"max R is that of the point {point} with {worst['payload']:g} kg, "
        f"|dX| {MM * abs(worst['error_x']):.1f} mm and |dY| {MM * abs(worst['error_y']):.1f} mm; "
        f"the other points stay below {MM * others.max():.1f} mm."
    ]
