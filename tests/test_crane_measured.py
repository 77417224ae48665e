"""Studies on cranes as built, and what the report says of the measured crane."""

import dataclasses
from pathlib import Path

import crane_case
import numpy as np
import pandas as pd
import pytest

from flexik.cases.crane import measured_report as said
from flexik.cases.crane.measured_figures import campaign_figures, named_points
from flexik.cases.crane.measured_results import Measured, jib_pushes
from flexik.cases.crane.measured_tables import MOVED, point_table, tables
from flexik.errors import FlexikError
from flexik.evaluation.conditions import every
from flexik.kinematics.crane import inverse_with_smallest_extension, pose
from flexik.kinematics.status import REACHED
from flexik.multibody.as_built import as_built_tips, draw_twin
from flexik.multibody.model import PlanarModel
from flexik.multibody.planar import tips as tips_of
from flexik.planar.measured import adaptation, budget, identified
from flexik.planar.measured.adapted import Nominal
from flexik.planar.measured.fields import campaign_fields, values_of
from flexik.planar.measured.offsets import offsets_of
from flexik.planar.measured.parts import measured_parts
from flexik.planar.measured.report import adaptation_figure
from flexik.planar.measured.section import Measured as Section
from flexik.positioning.combined import Combined, Settings
from flexik.positioning.method import Answer
from flexik.reporting.page import render

NOMINAL = crane_case.crane(8.45e6)
GEOMETRY, STROKES = NOMINAL.geometry, values_of(NOMINAL.machine)
SECTION = crane_case.section()
MEASURED = SECTION.studies.measured
NO_ERRORS = crane_case.magnitudes(*[0.0] * 8)
POINTS = np.array([[2.2, 0.95], [2.2, 0.15], [3.8, 0.95]])


class NoDeflection:
    """Stands for a trained network."""

    def predict(self, values):
        """Nothing bends."""
        return np.zeros((len(values), 2))


METHOD = Combined(crane_case.MANIPULATOR, NoDeflection())


def jib_tension(strokes, payload):
    model = PlanarModel.placed(NOMINAL, strokes)
    model.solve(payload)
    return model.pin_forces(["drives.jib"])["drives.jib"][0]


def study(deviations=None, **changes):
    """A small adaptation of one crane."""
    small = {"n_twins": 1, "n_measurements": [3, 6], "n_targets": 4, "others": ["second"]} | changes
    small["misjudged"] = MEASURED.adaptation.misjudged.model_copy(update={"n_measurements": [6]})
    sizes = MEASURED.campaign.deviations.model_copy(update=deviations or {})
    campaign = MEASURED.campaign.model_copy(update={"deviations": sizes})
    settings = MEASURED.adaptation.model_copy(update=small)
    methods = dict.fromkeys(("first", "second"), METHOD)
    nominal = Nominal(NOMINAL, NoDeflection(), settings.expected)
    return adaptation.Study(nominal, methods, campaign, settings)


def test_errors_of_a_crane_as_built_are_those_of_its_tips():
    first, again, other = (pd.DataFrame(adaptation.errors_of(study(), k)) for k in (2, 2, 3))
    kinds = [("first", 0), ("second", 0), ("adapted", 3), ("adapted", 6), ("misjudged", 6)]
    kinds.append(("second", 6))
    found = list(zip(first["method"], first["n_measurements"], strict=True))
    assert found == [kind for kind in kinds for _ in range(4)]
    assert (first["twin"] == 2).all()
    pd.testing.assert_frame_equal(first, again)
    assert not np.allclose(first["error"], other["error"])

    # without repeatability the unadapted errors follow from the strokes of the rigid inverse
    still = study({"repeatability": 0.0})
    table = pd.DataFrame(adaptation.errors_of(still, 2))
    # what predicts the same is adapted in the same way
    of_kind = table.set_index(["method", "n_measurements"])["error"]
    np.testing.assert_allclose(of_kind["second", 6], of_kind["adapted", 6], atol=5e-5)
    targets = table[:4][["target_x", "target_y"]].to_numpy()
    strokes = inverse_with_smallest_extension(GEOMETRY, targets).values
    twin = draw_twin(NOMINAL, still.campaign.deviations, still.adaptation.seed + 2)
    tips = as_built_tips(twin, strokes, table["payload"].to_numpy()[:4])
    expected = np.linalg.norm(tips - targets, axis=1)
    np.testing.assert_allclose(table["error"][:8], np.tile(expected, 2), atol=1e-6)


def fails(query, current):
    """A method that reaches nothing."""
    return Answer(current, np.full(len(query), REACHED + 1))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (study(x=(6.3, 7.0)), r"studies\.measured\.adaptation: the machine reaches"),
        (
            dataclasses.replace(study(), baselines={"first": fails}),
            "6 targets are not reached, the first is",
        ),
    ],
)
def test_targets_out_of_reach_are_told(changed, message):
    with pytest.raises(FlexikError, match=message):
        adaptation.errors_of(changed, 0)


def test_the_budget_has_every_deviation_alone_and_larger():
    given = crane_case.magnitudes(1e-3, 2e-3, 3e-4, 0.3, 4e-3, 5e-4, 0.03, 0.05)
    kinds = budget.kinds(given, 3.0)
    assert list(kinds)[:4] == [("none", 1.0), ("all", 1.0), ("pivot", 0.0), ("pivot", 3.0)]
    assert len(kinds) == 2 + 2 * 7
    assert kinds["all", 1.0] == given
    assert kinds["none", 1.0] == NO_ERRORS
    assert kinds["play", 0.0] == crane_case.magnitudes(0, 0, 3e-4, 0.3, 0, 0, 0, 0)
    assert kinds["length", 0.0] == crane_case.magnitudes(0, 2e-3, 0, 0, 0, 0, 0, 0)
    assert kinds["length", 3.0] == given.model_copy(update={"length": 3 * 2e-3})


def test_the_budget_counts_errors_from_targets_and_from_the_reference():
    query, _ = every(POINTS, [0.0, 172.0])
    targets, payload = query[:, :2], query[:, 2]
    strokes = inverse_with_smallest_extension(GEOMETRY, targets).values
    exact = MEASURED.campaign.model_copy(update={"noise": 0.0})
    both = {"none": strokes, "combined": strokes}
    item = budget.Item(4, {("none", 1.0): NO_ERRORS}, both)
    table = budget.errors_of(budget.Study(NOMINAL, exact, query), item)
    tips = tips_of(NOMINAL, strokes, payload)
    expected = np.linalg.norm(tips - targets, axis=1)
    np.testing.assert_allclose(table["error"], np.tile(expected, 2), atol=1e-7)
    moved = np.linalg.norm(tips - np.repeat(tips[::2], 2, axis=0), axis=1)
    np.testing.assert_allclose(table["reference_error"], np.tile(moved, 2), atol=1e-7)
    assert (table["twin"] == 4).all()


@pytest.mark.parametrize("missing", [STROKES, ["target_x", "target_y"]])
def test_what_a_campaign_lacks_gives_no_rows(missing, monkeypatch):
    """Without strokes nothing is identified, without targets nothing is commanded."""
    monkeypatch.setattr(identified, "table", lambda columns, fields: columns)
    rows = campaign(exact=True)
    rows = rows.assign(line=np.arange(len(rows)), **dict.fromkeys(missing, np.nan))
    found = identified.identified(
        nominal=Nominal(NOMINAL, NoDeflection(), MEASURED.adaptation.expected),
        campaign=rows[[field.name for field in campaign_fields(NOMINAL.machine)]],
        n_corrections=1,
        method=Settings(),
    )
    n_rows = {ending: len(next(iter(columns.values()))) for ending, columns in found.items()}
    whole = 0 if missing == STROKES else len(rows)
    known = offsets_of(NOMINAL.machine, MEASURED.adaptation.expected)
    offsets = 0 if missing == STROKES else len(known)
    assert n_rows == {".parquet": offsets, ".predictions.parquet": whole, ".commands.parquet": 0}


def test_a_campaign_of_a_file_leaves_the_other_studies_as_they_are():
    def described(file):
        campaign = MEASURED.campaign.model_copy(update={"file": file})
        measured = MEASURED.model_copy(update={"campaign": campaign})
        studies = SECTION.studies.model_copy(update={"measured": measured})
        return {
            part.name: part
            for part in measured_parts(SECTION.model_copy(update={"studies": studies}), measured)
        }

    built, own = described(None), described("own.csv")
    assert list(built) == list(own)
    assert own["measured/campaign"].inputs == {"file": "own.csv"}
    for name in built.keys() - {"measured/campaign"}:
        assert (built[name].settings, built[name].inputs) == (own[name].settings, own[name].inputs)
    assert own["measured/identified"].inputs["campaign"] == (
        SECTION.data / "studies/measured/campaign.parquet"
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"campaign": {"payloads": [86.0]}}, "expected 0, the reference of the errors"),
        ({"campaign": {"payloads": [0.0]}}, "expected a load beside 0"),
        ({"adaptation": {"n_measurements": [9, 3]}}, "must increase"),
        ({"adaptation": {"n_measurements": [3, 6]}}, "9 is not in n_measurements"),
        ({"adaptation": {"payload": [9.0, 1.0]}}, "must not decrease"),
        ({"adaptation": {"expected": {"pivot": 0.0}}}, "pivot"),
        ({"campaign": {"deviations": {"play": 0.3}}}, "play"),
    ],
)
def test_wrong_values_of_the_section_are_told(change, message):
    def merged(old, new):
        both = {k: merged(old[k], v) for k, v in new.items()} if isinstance(new, dict) else new
        return old | both if isinstance(new, dict) else both

    with pytest.raises(ValueError, match=message):
        Section(**merged(MEASURED.model_dump(), change))


def campaign(payloads=(0.0, 172.0), exact=False):
    """Reached points 10 mm off without compensation, 2 mm with it, but for the second point."""
    rows = []
    strokes = inverse_with_smallest_extension(GEOMETRY, POINTS).values
    for method, error in (("none", 0.010), ("combined", 0.002)):
        for number, (point, row) in enumerate(zip(POINTS, strokes, strict=True)):
            for payload in payloads:
                off = 0.012 if method == "combined" and number == 1 else error
                off = 0.0 if exact else off
                rows.append([method, *point, payload, *row, point[0] - off, point[1]])
    columns = ["method", "target_x", "target_y", "payload", *STROKES, "measured_x", "measured_y"]
    return pd.DataFrame(rows, columns=columns)


def many_cranes():
    """Three cranes; compensation makes the second point worse on two of them."""
    rows = campaign()
    found = []
    for twin, off in enumerate((0.009, 0.011, 0.012)):
        spoilt = (rows["method"] == "combined") & (rows["target_y"] == POINTS[1, 1])
        table = rows[["method", "target_x", "target_y", "payload"]].assign(
            deviation="all",
            factor=1.0,
            twin=twin,
            error=np.where(spoilt, off, np.where(rows["method"] == "none", 0.010, 0.002)),
        )
        table["reference_error"] = table["error"] - 0.001
        found.append(table)
    given = pd.concat(found)
    larger = [
        given.assign(deviation=name, factor=3.0, reference_error=times * given["reference_error"])
        for name, times in (("play", 1.5), ("repeatability", 2.0))
    ]
    # without deviations the network's error makes the second point worse
    perfect = given.assign(deviation="none")
    spoilt = (perfect["method"] == "combined") & (perfect["target_y"] == POINTS[1, 1])
    for name in ("error", "reference_error"):
        perfect[name] = perfect[name].where(~spoilt, 0.02)
    return pd.concat([perfect, given, *larger])


OFFSETS = pd.DataFrame(
    {
        "offset": ["pillar.lift_pivot.x", "spring"],
        "unit": ["m", "1"],
        "expected": 0.0,
        "expected_deviation": [3e-4, 0.05],
        "identified": [-30e-4, 0.1],
        "deviation": [1e-4, 0.02],
    }
)
PREDICTIONS = pd.DataFrame(
    {
        "line": [7, 8, 9],
        "payload": [0.0, 86.0, 172.0],
        "measured_x": [3.0, 3.1, 3.2],
        "measured_y": 1.0,
        "nominal_error": [0.001, 0.3, 0.02],
        "adapted_error": [0.001, 0.3, np.nan],
        "surprise": [1.0, 30.0, 4.0],
        "left_out_surprise": [4.0, 40.0, np.nan],
        "used": [1, 0, 1],
    }
)


@pytest.fixture
def results():
    errors = pd.DataFrame(
        {
            "method": np.repeat(["combined_selected", "adapted", "misjudged"], 42),
            "n_measurements": np.repeat([0, 9, 9], 42),
            "twin": np.tile(np.repeat([5, 3], 21), 3),
            "error": np.concatenate([1e-3 * k * np.arange(21.0) for k in (4, 3, 2, 1, 3, 3)]),
        }
    )
    cranes = many_cranes()
    columns = [f"{m}_{p}" for p in ("0_kg", "86_kg", "172_kg", "all") for m in ("none", "combined")]
    published = {
        name: pd.read_csv(
            crane_case.ROOT / f"data/reference/crane/{name}.csv", index_col="statistic"
        )[columns]
        for name in ("measured_errors", "measured_reference_errors")
    }
    return Measured(
        section=SECTION,
        crane=NOMINAL,
        campaign=campaign(),
        budget=cranes,
        restarts=cranes[cranes["deviation"] == "none"],
        adaptation=errors,
        offsets=OFFSETS,
        predictions=PREDICTIONS,
        commands=pd.DataFrame({"payload": [0.0], "status": [REACHED]}),
        published=published,
    )


def test_statistics_are_by_crane(results):
    adapted = results.adapted
    assert (
        adapted["method"].tolist()
        == ["combined_selected"] * 2 + ["adapted"] * 2 + ["misjudged"] * 2
    )
    assert adapted["twin"].tolist() == [3, 5] * 3
    np.testing.assert_allclose(1e3 * adapted["mean_error"][:4], [30, 40, 10, 20])
    np.testing.assert_allclose(1e3 * adapted["p95_error"][:4], [57, 76, 19, 38])
    means = results.budget_means.query("deviation == 'all'")
    np.testing.assert_allclose(1e3 * means["none"], 10.0)
    np.testing.assert_allclose(1e3 * means["combined"], [13 / 3, 5, 16 / 3])
    np.testing.assert_allclose(1e3 * means["combined_reference"], [10 / 3, 4, 13 / 3])
    table = tables(results)["adaptation"].frame
    assert table["N"].tolist() == [0, 9, 9]
    np.testing.assert_allclose(table["mean R (mm)"], [35, 15, 30])
    np.testing.assert_allclose(table["mean R of the worst machine (mm)"], [40, 20, 30])
    np.testing.assert_allclose(table["max R (mm)"], [80, 40, 60])
    np.testing.assert_allclose(table["ratio to unadapted"], [1, 3 / 7, 6 / 7])


def test_the_jib_cylinder_pushes_where_the_flexible_crane_says_so(results):
    strokes, pushes = jib_pushes(results)
    expected = [any(jib_tension(row, load) < 0.0 for load in (0.0, 172.0)) for row in strokes]
    assert pushes.tolist() == expected
    assert 0 < sum(expected) < len(expected)


def test_points_are_told_by_angle_force_and_share(results):
    table = point_table(results)
    poses = pose(GEOMETRY, inverse_with_smallest_extension(GEOMETRY, POINTS).values)
    lean = np.degrees(poses.jib_angle) + 90.0
    np.testing.assert_allclose(table["jib from vertical (deg)"], lean)
    assert (lean < 0).tolist() == [True, True, False]
    np.testing.assert_allclose(table["worse with (%)"], [0, 200 / 3, 0])
    np.testing.assert_allclose(table["worse with, no deviations (%)"], [0, 100, 0])
    np.testing.assert_allclose(table["R without (mm)"], 10.0)
    np.testing.assert_allclose(table["R with (mm)"], [2, 32 / 3, 2])
    np.testing.assert_allclose(table[MOVED], [1, 29 / 3, 1])
    found = said.values(results)["measured"]
    points = found["points"]
    assert (points["beyond"], points["pushing"], points["turning"]) == ([1, 2], ["2 (172 kg)"], [2])
    assert (points["turned"], points["others"]) == pytest.approx((29e-3 / 3, 1e-3))
    assert points["shares"] == [[2, pytest.approx(200 / 3), pytest.approx(200 / 3)], [3, 0, 0]]
    assert points["perfect"] == found["restarts"]["shares"] == [[2, 100, 100], [3, 0, 0]]
    assert not points["reproduced"]


def test_the_budget_names_what_matters_most(results):
    found = said.values(results)["measured"]["sensitivity"]
    assert (found["name"], found["factor"], found["published"]) == ("repeatability", 3.0, 4.7)
    assert found["larger"] == pytest.approx(2 * found["given"])
    table = tables(results)["error_budget"].frame
    assert table["deviation"].tolist() == [
        "none",
        "all",
        "all, joint play x 3",
        "all, repeatability x 3",
    ]


def test_metrics_are_means_over_all(results):
    found = said.metrics(results)
    assert found["measured.none.mean_error_mm"] == pytest.approx(10.0)
    assert found["measured.combined.mean_error_mm"] == pytest.approx((2 + 2 + 12) / 3, abs=1e-3)
    # from the point reached with 0 kg and compensation: 8, 2 and 8 mm without, none with it
    assert found["measured.reference.none.mean_error_mm"] == pytest.approx(6.0)
    assert found["measured.reference.combined.mean_error_mm"] == pytest.approx(0.0)
    assert found["measured.unadapted.combined_selected.mean_error_mm"] == pytest.approx(35.0)
    assert found["measured.adapted_9.mean_error_mm"] == pytest.approx(15.0)
    cranes = results.budget_means.query("deviation == 'all'")["combined"]
    for which, value in {"": cranes.mean(), "least_": min(cranes), "largest_": max(cranes)}.items():
        name = f"measured.cranes.combined.{which}mean_error_mm"
        assert found[name] == pytest.approx(1e3 * value, abs=1e-3)
    assert found["measured.cranes.none.mean_error_mm"] == pytest.approx(10.0)
    assert found["measured.prediction.nominal.mean_error_mm"] == pytest.approx(107.0)
    unknown = results.campaign.assign(target_x=np.nan, target_y=np.nan, method="")
    nothing = {"campaign": unknown, "predictions": PREDICTIONS[:0], "offsets": OFFSETS[:0]}
    less = dataclasses.replace(results, **nothing)
    assert found.keys() - said.metrics(less).keys() == {
        *(f"measured.{k}.mean_error_mm" for k in ("none", "combined")),
        *(f"measured.reference.{k}.mean_error_mm" for k in ("none", "combined")),
        *(f"measured.prediction.{k}.mean_error_mm" for k in ("nominal", "adapted")),
    }
    assert set(tables(less)) == {"measured_points", "error_budget", "adaptation"}


def test_measurements_that_stand_out_and_what_does_not_fit_are_told(results):
    found = said.values(results)["measured"]["predictions"]
    assert (found["n"], found["n_out"], found["n_alone"]) == (3, 1, 1)
    assert [(row["line"], row["distance"]) for row in found["out"]] == [(8, 40.0)]
    assert found["misfit"] == pytest.approx(3.4, abs=0.01)
    (far,) = found["far"]
    assert (far["offset"], far["away"]) == ("pillar.lift_pivot.x", pytest.approx(10.0))
    rows = tables(results)["measured_predictions"].frame
    assert rows["measurements"].tolist() == [3, 2]
    np.testing.assert_allclose(rows["max (mm)"], [300, 300])
    fits = PREDICTIONS[:1].assign(left_out_surprise=1.0)
    near = OFFSETS.assign(identified=0.0)
    found = said.values(dataclasses.replace(results, predictions=fits, offsets=near))
    assert not any(found["measured"]["predictions"][k] for k in ("out", "misfit", "far", "n_alone"))


def page(results):
    """Text of the part measured.md.j2, sentences on one line each."""
    content = said.content(results)
    template = Path(said.__file__).with_name("measured.md.j2")
    return render(template, content.tables, content.figures, content.values).text


def test_the_page_says_what_was_found(results):
    text = page(results)
    for sentence in (
        "stands in for it, so single values cannot agree",
        "Mean R of 20 cranes whose deviations are drawn with these sizes, and the least and "
        "largest mean of one of them, mm: without 10.0 (10.0 to 10.0); with 4.9 (4.3 to 5.3);",
        "Other payloads than published, so nothing stands beside those over all.",
        "beyond the vertical in points 1 and 2, in the thesis in points 2 and 3,",
        "it pushes in point 2 (172 kg); elsewhere",
        "in point 2, play changes sides: loaded, the compensated tip lies 9.7 mm from the point of "
        "reference, elsewhere 1.0 mm.",
        "on which it does so here, from either: 2: 67 % and 67 %; 3: 0 % and 0 %. The remark is",
        "the shares are 2: 100 % and 100 %; 3: 0 % and 0 %.",
        "over the networks of 3 starts, each on a crane without deviations, the shares are 2: 100",
        "with those of 3 starts 8.0 mm to 8.0 mm from the target and 7.3 mm to 7.3 mm from the",
        "repeatability matters most for it: 3 times as large, it makes 7.8 mm.",
        "1 of 3 measurements stand out from what the others say and are left out",
        "point): 8 (40, 86 kg, 3.100, 1.000 m).",
        "measurements lie 3.4 times as far from their predictions as they should",
        "an error of the origin or of units makes too: pillar.lift_pivot.x (10).",
        "Measurements with too few others to be predicted from: 1.",
        "and of the adapted one at the 1 targets and payloads of the campaign.",
    ):
        assert sentence in text


def test_the_page_says_what_a_campaign_of_a_file_lacks(results):
    file = MEASURED.campaign.model_copy(update={"file": "own.csv"})
    measured = MEASURED.model_copy(update={"campaign": file})
    studies = SECTION.studies.model_copy(update={"measured": measured})
    own = dataclasses.replace(results, section=SECTION.model_copy(update={"studies": studies}))
    assert "The measurements are those of `own.csv`" in page(own)
    unknown = results.campaign.assign(target_x=np.nan, target_y=np.nan, method="")
    nothing = {name: getattr(results, name)[:0] for name in ("predictions", "offsets", "commands")}
    text = page(
        dataclasses.replace(own, campaign=unknown, restarts=results.restarts[:0], **nothing)
    )
    assert "It has no targets, so there are no tables of errors and no commands." in text
    assert "nothing is identified from it." in text
    assert "starts" not in text
    assert text.count("![") == 1


def test_tables_have_the_published_values_of_their_payloads_beside_ours(results):
    table = tables(results)["measured_errors"].frame
    assert list(table.columns) == [
        *("compensation", "statistic", "0 kg", "0 kg published"),
        *("172 kg", "172 kg published", "all", "all published"),
    ]
    assert table["compensation"].tolist() == ["without"] * 6 + ["with"] * 6
    largest = table[table["statistic"] == "max R (mm)"]
    np.testing.assert_allclose(largest["all"], [10, 12])
    np.testing.assert_array_equal(largest["172 kg published"], [28.9, 15.6])
    assert table["all published"].isna().all()  # published over three payloads
    three = dataclasses.replace(results, campaign=campaign((0.0, 86.0, 172.0)))
    table = tables(three)["measured_errors"].frame
    row = table[(table["compensation"] == "with") & (table["statistic"] == "mean |dX| (mm)")]
    numbers = [16 / 3, 8.2, 16 / 3, 8.2, 16 / 3, 7.9, 16 / 3, 8.1]
    np.testing.assert_allclose(row.iloc[0, 2:].astype(float), numbers)
    assert "is 28.8 mm, but with one of the payloads 28.9 mm: a slip" in page(three)


def test_figures_show_the_campaign_and_the_adaptation(results):
    strokes, pushes = jib_pushes(results)
    drawings = campaign_figures(results.errors, GEOMETRY, strokes, pushes)
    assert set(drawings) == {
        *("measured_points", "measured_point_1", "measured_point_2"),
        *(f"measured_{o}errors_{axis}" for o in ("", "reference_") for axis in "xy"),
    }

    def drawn(drawing):
        return drawing().axes

    bars = [
        [
            patch.get_height()
            for patch in axes.patches
            if patch.get_height() > 0 and patch.get_width() < 0.5
        ]
        for axes in drawn(drawings["measured_errors_x"])
    ]
    np.testing.assert_allclose(sorted(bars[0]), [10] * 6)
    np.testing.assert_allclose(sorted(bars[1]), [2, 2, 2, 2, 12, 12])
    assert [text.get_text() for text in drawn(drawings["measured_points"])[0].texts] == [
        "2",
        "1",
        "3",
    ]
    lines = drawn(drawings["measured_point_2"])[0].lines
    dots = [line.get_xydata() for line in lines if line.get_label() == "with compensation"]
    np.testing.assert_allclose(dots, [[[-2, 0], [-2, 0]]], atol=1e-9)
    assert named_points(np.array([[3.8, 0.95], [1, 1], [3.8, 0.15]])).tolist() == [
        [3.8, 0.15],
        [3.8, 0.95],
    ]

    left, right = drawn(adaptation_figure(results.adapted, {9: 0.002}))
    for axes, means in ((left, [35, 15]), (right, [66.5, 28.5])):
        (curve,) = (line for line in axes.lines if line.get_marker() == "o")
        np.testing.assert_allclose(curve.get_xydata(), np.column_stack([[0, 9], means]))
    (goal,) = (line for line in left.lines if line.get_marker() == "v")
    np.testing.assert_allclose(goal.get_ydata(), 2.0)
    assert not [line for line in right.lines if line.get_marker() == "v"]
