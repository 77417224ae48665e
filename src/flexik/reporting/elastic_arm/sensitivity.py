"""What the networks given gauges read the pose from: errors when one input is off."""

import pandas as pd

from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.gauges import FREE_OF_NOISE
from flexik.datasets.elastic_arm.readings import HELD_OUT
from flexik.reporting.elastic_arm.results import Results
from flexik.reporting.style import MM

MICRO = 1e6
NOTHING = "nothing"
NOISE = {
    gauges.FREE_OF_NOISE: "without noise",
    gauges.NOISY: "with noise",
    gauges.NOISY_VOLTAGES: "with noise in the voltages alone",
}


def shown_rows(results: Results) -> list[str]:
    """Networks given gauges that a method takes, in the order of the methods."""
    names = [m.network for m in results.arm.methods.values() if m.method == "gauges"]
    return [name for name in dict.fromkeys(names) if name in results.gauge_networks]


def mean_errors(results: Results) -> pd.DataFrame:
    """Mean tip error in mm, a row for every input that is off (first nothing), by network."""
    given = results.sensitivity
    table = given.pivot_table(index="input", columns="network", values="error", aggfunc="mean")
    return MM * table.loc[list(dict.fromkeys(given["input"]))]


def changes(results: Results) -> pd.Series:
    """By how much each input is off, m or rad."""
    return results.sensitivity.groupby("input", sort=False)["change"].first()


def sensitivity_table(results: Results) -> pd.DataFrame:
    """Mean tip errors in mm by input and network, and by how much the input is off."""
    errors = mean_errors(results)
    table = errors[shown_rows(results) or list(errors.columns)]
    off = MICRO * changes(results).loc[table.index].to_numpy()
    table.insert(0, "off by (um, urad)", off)
    return table.rename_axis("input that is off").reset_index().rename_axis(columns=None)


def sensitivity_text(results: Results) -> str:
    """What the published inputs tell, how exactly, and what is left without it."""
    arm, name = results.arm, results.arm.splits.network
    shown = results.shown[FREE_OF_NOISE]
    largest = [MICRO * shown[f"dx_{link}"].abs().max() for link in (1, 2)]
    strains = [MICRO * shown[f"strain_{link}"].abs().max() for link in (1, 2)]
    errors, off = mean_errors(results)[name], changes(results)
    worst = str(errors.drop(NOTHING).idxmax())
    unit = "microradian" if worst.startswith("dphi") else "micrometre"
    text = (
        "The six deformation variables are those of the very pose the network should find, and "
        "its elongations dx tell more of that pose than an elongation should: dx by the gauges is "
        "an axial strain times the length (equation 54), the strain is that of the force along "
        "the link, and the share of a weight that acts along a link is the sine of its angle. "
        f"The elongations are small, {largest[0]:.2f} micrometres at most on link 1 and "
        f"{largest[1]:.2f} on link 2 ({strains[0]:.2f} and {strains[1]:.2f} microstrain), but a "
        "network scales every input to [-1, 1], and without noise any size will do. "
        f"`{name}` misses the tip by {errors[NOTHING]:.2f} mm on average in the held-out readings. "
        f"With one input off by what the assumed gauges leave uncertain it depends most on "
        f"{worst}: "
        f"{errors[worst]:.2f} mm with {worst} off by {MICRO * off[worst]:.3g} {unit}s."
    )
    like = arm.networks[name]
    lines = []
    for other in results.gauge_networks:
        network = arm.all_networks[other]
        same = network.trainer == like.trainer and results.layers[other] == results.layers[name]
        if same:
            fit = results.fit_of(other, HELD_OUT)
            given = {
                "gauges_without_dx": "without dx",
                "gauges_elbow": "with the elbow too",
            }.get(network.kind, "with dx")
            noise = NOISE[network.readings or FREE_OF_NOISE]
            lines.append(
                f"- `{other}` (gauges {noise}, {given}): held-out R {fit.r[0]:.6f} and "
                f"{fit.r[1]:.6f}, mean tip error {MM * fit.mean_error:.2f} mm."
            )
    head = "Networks of the same size and trainer, each trained with its own inputs:\n\n"
    return "\n\n".join([text, head + "\n".join(lines), *_verdict(results)])


def _verdict(results: Results) -> list[str]:
    """Which noise costs the published network more, where all three were trained."""
    like = results.arm.networks[results.arm.splits.network]
    errors: dict[str, float] = {}
    for name in results.gauge_networks:
        network = results.arm.all_networks[name]
        same = network.trainer == like.trainer and network.kind == like.kind
        if same and results.layers[name] == results.layers[results.arm.splits.network]:
            errors.setdefault(str(network.readings), MM * results.fit_of(name, HELD_OUT).mean_error)
    if set(errors) != set(gauges.SHOWN):
        return []
    free, noisy, voltages = (errors[shown] for shown in gauges.SHOWN)
    by_voltages, by_strains = voltages - free, noisy - voltages
    more = "strains" if by_strains > by_voltages else "voltages"
    given = results.arm.gauges
    return [
        f"Noise in the voltages alone changes the mean tip error by {by_voltages:+.2f} mm, noise "
        f"in "
        f"the strains on top of it by {by_strains:+.2f} mm: the assumed noise of the {more} "
        f"({MICRO * given.strain_noise:g} microstrain, steps of "
        f"{MICRO * given.strain_resolution:g}; {1e3 * given.noise:g} mV, steps of "
        f"{1e3 * given.resolution:g}) costs more. It is assumed, not published, and so is the "
        f"error "
        "with noisy gauges."
    ]
