"""What the measured campaign says of the crane: offsets, predictions, commands."""

from pathlib import Path

import pandas as pd

from flexik.files import write_text
from flexik.positioning.method import REACHED
from flexik.reporting.style import MM

# Distance from the expected in standard deviations above which a measurement is named
SURPRISING = 5.0
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


def prediction_notes(predictions: pd.DataFrame) -> list[str]:
    """Which measurements surprise, and what no prediction could be made for."""
    notes = []
    surprising = predictions[predictions["surprise"] > SURPRISING]
    if len(surprising):
        worst = surprising.nlargest(LISTED, "surprise")
        named = ", ".join(
            f"{row['measurement']:g} ({row['surprise']:.0f}, {row['payload']:g} kg, "
            f"{row['measured_x']:.3f}, {row['measured_y']:.3f} m)"
            for _, row in worst.iterrows()
        )
        notes.append(
            f"{len(surprising)} of {len(predictions)} measurements lie more than {SURPRISING:g} "
            f"standard deviations from what was expected, so a slip of the pen is more likely, or "
            f"`expected` is too small; they are used all the same. Measurement (standard "
            f"deviations, payload, measured point): {named}."
        )
    else:
        notes.append(
            f"No measurement lies more than {SURPRISING:g} standard deviations from what was "
            "expected."
        )
    if missing := int(predictions["adapted_error"].isna().sum()):
        notes.append(f"{missing} measurements have too few others to be predicted from.")
    return notes


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
