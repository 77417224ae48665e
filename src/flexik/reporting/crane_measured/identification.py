"""What the measured campaign says of the crane: offsets, predictions, commands."""

from pathlib import Path

import pandas as pd

from flexik.evaluation.crane_measured.predictions import misfit
from flexik.files import write_text
from flexik.positioning.method import REACHED
from flexik.reporting.style import MM

# Identified offsets this many expected deviations from the expected are named
FAR = 4.0
# Measured distances are this many times as large as they should be before they are worth a note
POOR = 1.5
LISTED = 5
DECIMALS = 5  # of commanded strokes, m


def offset_table(offsets: pd.DataFrame) -> pd.DataFrame:
    """Offsets before and after measuring, in mm and percent, standard deviations after +-."""
    scale = offsets["unit"].map({"m": MM, "1": 100.0})
    unit = offsets["unit"].map({"m": "mm", "1": "%"})
    return pd.DataFrame(
        {
            "offset": offsets["offset"],
            "unit": unit,
            "expected": scale * offsets["expected"],
            "+- before": scale * offsets["expected_deviation"],
            "identified": scale * offsets["identified"],
            "+- after": scale * offsets["deviation"],
        }
    )


def prediction_table(predictions: pd.DataFrame) -> pd.DataFrame:
    """Distances of the measured points from their predictions, mm, nominal and adapted."""
    rows = []
    for label, column in (("nominal", "nominal_error"), ("adapted", "adapted_error")):
        error = MM * predictions[column].dropna()
        if error.empty:
            continue
        rows.append(
            {
                "crane": label,
                "measurements": len(error),
                "mean (mm)": error.mean(),
                "95th percentile (mm)": error.quantile(0.95),
                "max (mm)": error.max(),
            }
        )
    return pd.DataFrame(rows)


def prediction_notes(predictions: pd.DataFrame, offsets: pd.DataFrame) -> list[str]:
    """Which measurements stand out, and how well crane and expectations fit."""
    notes = []
    distance = predictions["left_out_surprise"].fillna(predictions["surprise"]).to_numpy()
    out = predictions.assign(distance=distance)[predictions["used"] == 0]
    if len(out):
        named = ", ".join(
            f"{row['line']:g} ({row['distance']:.0f}, {row['payload']:g} kg, "
            f"{row['measured_x']:.3f}, {row['measured_y']:.3f} m)"
            for _, row in out.nlargest(LISTED, "distance").iterrows()
        )
        notes.append(
            f"{len(out)} of {len(predictions)} measurements stand out from what the others say and "
            "are left out of the identification. Line (standard deviations, payload, measured "
            f"point): {named}."
        )
    else:
        notes.append("No measurement stands out from what the others say.")
    if (factor := misfit(distance[predictions["used"] == 1])) > POOR:
        notes.append(
            f"In the median, measurements lie {factor:.1f} times as far from their predictions as "
            "they should: the crane differs in more than is looked for, or `expected` is too "
            "small, and the deviations after measuring are too small by as much."
        )
    away = (offsets["identified"] - offsets["expected"]).abs() / offsets["expected_deviation"]
    if (away > FAR).any():
        far = offsets[away > FAR].assign(away=away).nlargest(LISTED, "away")
        named = ", ".join(
            f"{name} ({size:.0f})" for name, size in zip(far["offset"], far["away"], strict=True)
        )
        notes.append(
            f"Identified offsets more than {FAR:g} expected deviations from the expected, which "
            f"an error of the origin or of units makes too: {named}."
        )
    if missing := int(predictions["adapted_error"].isna().sum()):
        notes.append(f"Measurements with too few others to be predicted from: {missing}.")
    return notes


def write_predictions(path: Path, predictions: pd.DataFrame) -> None:
    """Write the distances of every measurement as CSV, in m and standard deviations."""
    units = {name: f"{name}_m" for name in predictions.columns if name.endswith(("_x", "_y"))}
    units |= {name: f"{name}_m" for name in ("nominal_error", "adapted_error")}
    table = predictions.rename(columns=units | {"payload": "payload_kg"})
    write_text(path, table.round(DECIMALS).to_csv(index=False, lineterminator="\n"))


def write_commands(path: Path, commands: pd.DataFrame) -> None:
    """Write strokes at all targets, in m, as CSV."""
    units = {name: f"{name}_kg" if name == "payload" else f"{name}_m" for name in commands.columns}
    table = commands.drop(columns="status").rename(columns=units)
    text = table.round(DECIMALS).to_csv(index=False, lineterminator="\n")
    write_text(path, text)


def command_text(commands: pd.DataFrame, name: str) -> str:
    """What the CSV `name` holds."""
    failed = int((commands["status"] != REACHED).sum())
    ending = f" {failed} of them are not reached." if failed else ""
    return (
        f"[{name}]({name}) has the strokes of the rigid inverse, of the compensator of the nominal "
        f"crane and of the adapted one at the {len(commands)} targets and payloads of the "
        f"campaign.{ending}"
    )
