"""One look for all figures, and PNG files whose bytes depend on the data alone."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from flexik.errors import DataError
from flexik.files import atomic_path

MM = 1e3  # millimetres in a metre, mrad in a rad
MICRO = 1e6
DEGREES = 180.0 / np.pi
WIDTH = 8.0  # inches: 1200 pixels, which GitHub shows at about 900

# Okabe and Ito's palette, told apart with every kind of colour vision
BLUE, SKY, GREEN = "#0072B2", "#56B4E9", "#009E73"
ORANGE, VERMILION, PURPLE = "#E69F00", "#D55E00", "#CC79A7"
INK, GREY, PALE = "#262626", "#8C8C8C", "#D9D9D9"
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, INK, GREY)
DASHES = ("-", "--", ":", "-.")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")

Look = Mapping[str, Any]  # keywords of Axes.plot: color, linestyle, marker

# the same everywhere: published values, what was chosen
PUBLISHED: Look = {"color": INK, "linestyle": "--", "linewidth": 1.2}
CHOSEN: Look = {"color": VERMILION, "linestyle": "-", "linewidth": 1.5}

STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "figure.constrained_layout.use": True,
    "figure.dpi": 150,
    "font.family": "DejaVu Sans",  # comes with matplotlib, so every machine has the same
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
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


def write_png(path: Path | str, build: Callable[..., Figure], *data: Any, **options: Any) -> None:
    """Write the figure `build(*data, **options)` to `path`, whole or not at all.

    The file carries no version of matplotlib and no date.
    """
    with house_style():
        figure = build(*data, **options)
        with atomic_path(path) as temporary:
            FigureCanvasAgg(figure).print_png(str(temporary), metadata={"Software": None})


def looks(names: Iterable[Any], suffixes: Sequence[str] = ()) -> dict[Any, dict[str, Any]]:
    """Colour, line and marker by name: one hue a name, the same in every figure of a case.

    names : methods, networks, trainers of the case, all of them in a fixed order.
    suffixes : a name that ends with one of these has the hue of the name without it; its line and
        marker are the next of DASHES and MARKERS for each suffix.
    """
    found, bases = {}, dict[str, int]()
    for name in names:
        variant = next((k for k, s in enumerate(suffixes, 1) if str(name).endswith(s)), 0)
        base = str(name).removesuffix(suffixes[variant - 1]) if variant else str(name)
        number = bases.setdefault(base, len(bases))
        kind = variant + (len(suffixes) + 1) * (number // len(COLOURS))
        found[name] = {
            "color": COLOURS[number % len(COLOURS)],
            "linestyle": DASHES[kind % len(DASHES)],
            "marker": MARKERS[kind % len(MARKERS)],
        }
    return found


def shades(values: Iterable[float], colours: str = "viridis") -> dict[Any, dict[str, Any]]:
    """Looks by an ordered quantity (payload, number of steps), dark for the least."""
    known = sorted(set(values))
    tones = np.linspace(0.0, 0.88, max(len(known), 2))
    palette = mpl.colormaps[colours]
    return {v: {"color": mpl.colors.to_hex(palette(t))} for v, t in zip(known, tones, strict=False)}


def signed(value: float) -> str:
    """Shortest decimal form with a real minus sign; zero has none."""
    return f"{value + 0.0:g}".replace("-", "\N{MINUS SIGN}")


def digits(value: float, n: int = 3) -> str:
    """Decimal form of `n` significant digits, without zeros at the end."""
    return np.format_float_positional(float(value), n, fractional=False, trim="-")


def coordinates(*point: float) -> str:
    """Name of a point: its coordinates in m."""
    return f"({', '.join(signed(value) for value in point)})"


def require(what: str, found: Iterable[object], expected: Iterable[str]) -> None:
    """Raise a DataError naming the `expected` columns or keys that are not among `found`."""
    present = list(found)
    if missing := [name for name in expected if name not in present]:
        raise DataError(f"{what}: expected {missing} too, found {present}")
