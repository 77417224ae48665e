"""One look for all figures, and PNG files whose bytes depend on the data alone."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from flexik.errors import DataError
from flexik.files import atomic_path

MM = 1e3  # millimetres in a metre
WIDTH = 8.0  # inches: 1200 pixels, which GitHub shows at about 900

# Okabe and Ito's palette, told apart with every kind of colour vision
BLUE, SKY, GREEN = "#0072B2", "#56B4E9", "#009E73"
ORANGE, VERMILION, PURPLE = "#E69F00", "#D55E00", "#CC79A7"
INK, GREY, PALE = "#262626", "#8C8C8C", "#D9D9D9"

STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 10,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10.5,
    "axes.unicode_minus": True,
    "figure.constrained_layout.use": True,
    "figure.dpi": 150,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",  # comes with matplotlib, so every machine has the same
    "font.size": 10,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "savefig.dpi": 150,
    "text.color": INK,
    "xtick.color": INK,
    "xtick.labelsize": 9.5,
    "ytick.color": INK,
    "ytick.labelsize": 9.5,
}


@contextlib.contextmanager
def house_style() -> Iterator[None]:
    """Set STYLE over matplotlib's own defaults; a user's settings have no say and come back."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def write_png(path: Path | str, build: Callable[..., Figure], *data: Any) -> None:
    """Write the figure `build(*data)` to `path` in the house style, whole or not at all.

    The file carries no version of matplotlib and no date.
    """
    with house_style():
        figure = build(*data)
        with atomic_path(path) as temporary:
            FigureCanvasAgg(figure).print_png(str(temporary), metadata={"Software": None})


def payload_colours(payloads: Iterable[float]) -> dict[float, tuple[float, ...]]:
    """Colours of viridis by payload, dark for the lightest."""
    values = sorted({float(p) for p in payloads})
    shades = np.linspace(0.0, 0.88, max(len(values), 2))
    return {p: mpl.colormaps["viridis"](s) for p, s in zip(values, shades, strict=False)}


def plane(axes: Axes) -> None:
    """Axes of the boom's plane: equal scales, labelled in m."""
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")


def true_minus(axes: Axes) -> None:
    """Whole or decimal tick labels with a real minus sign, also on logarithmic scales."""
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: signed(value)))


def signed(value: float) -> str:
    """Shortest decimal form with a real minus sign; zero has none."""
    return f"{value + 0.0:g}".replace("-", "\N{MINUS SIGN}")


def coordinates(x: float, y: float) -> str:
    """Name of a point: its coordinates in m."""
    return f"({signed(x)}, {signed(y)})"


def require(what: str, found: Iterable[object], expected: Iterable[str]) -> None:
    """Raise a DataError naming the `expected` columns or keys that are not among `found`."""
    present = list(found)
    if missing := [name for name in expected if name not in present]:
        raise DataError(f"{what}: expected {missing} too, found {present}")


def finite(what: str, values: Mapping[str, Any]) -> None:
    """Raise a DataError naming the first entry of `values` that holds something not finite."""
    for name, numbers in values.items():
        if not np.isfinite(np.asarray(numbers, dtype=float)).all():
            raise DataError(f"{what}: {name} is not finite")
