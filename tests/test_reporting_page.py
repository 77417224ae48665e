"""Pages from templates, and reports as a whole: what is written, drawn again and removed."""

from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.errors import DataError
from flexik.files import file_checksum, read_json
from flexik.reporting import report as reports
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.page import FILTERS, render, unwrapped
from flexik.reporting.report import Content, digest, draw, write_report
from flexik.reporting.tables import Table

TEMPLATE = """
# Arm

`{{ best }}` errs by {{ error | mm }}
on average.
{% call table("sub/errors") %}
Errors of {{ n }} conditions,
|dX| among them.
{% for name in names %}
- {{ name }}: {{ 0.123 | percent(1) }},
  at {{ (1, -2) | point }}.
{% endfor %}
{% endcall %}
{{ figure("curve", "A [curve]") }}
{{ figure("other curve", "Another.") }}
"""
PAGE = """# Arm

`a` errs by 1.20 mm on average.

Errors of 3 conditions, |dX| among them.

|    R |
| ---: |
| 1.00 |

- a: 12.3 %, at (1, \N{MINUS SIGN}2).
- b: 12.3 %, at (1, \N{MINUS SIGN}2).

[errors.csv](sub/errors.csv)

![A (curve)](figures/curve.png)

*A [curve]*

![Another.](figures/other%20curve.png)

*Another.*
"""


def drawing(values, **options):
    frame = pd.DataFrame({"x": range(len(values)), "y": values})
    return draw(chart, Layer(frame, "x", "y"), x=Axis("x (1)"), y=Axis("y (mm)"), **options)


@pytest.fixture
def template(tmp_path):
    path = tmp_path / "page.md.j2"
    path.write_text(TEMPLATE)
    return path


def content(**changes):
    given = {
        "tables": {"sub/errors": Table(pd.DataFrame({"R": [1.0]}))},
        "figures": {"curve": drawing([1.0, 2.0]), "other curve": drawing([3.0, 4.0])},
        "metrics": {"a": 1.0},
        "values": {"best": "a", "error": 0.0012, "n": 3, "names": ["a", "b"]},
    }
    return Content(**given | changes)


def rendered(path, given):
    return render(path, given.tables, given.figures, given.values)


def test_a_page_is_its_template_filled_in(template):
    page = rendered(template, content())
    assert page.text == PAGE
    assert page.tables["sub/errors"].startswith("Errors of 3 conditions, |dX| among them.\n\n|")
    assert page.figures == ["curve", "other curve"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("{{ best }}", "{{ worst }}", "line 4: 'worst' is undefined"),
        ('table("sub/errors")', 'table("errors")', "tables: expected .'errors'. too"),
        ('figure("curve"', 'figure("curves"', "figures: expected .'curves'. too"),
        ('{{ figure("curve", "A [curve]") }}', "", "nowhere shows curve"),
        ("{% endfor %}", "", "page.md.j2, line 13"),
    ],
)
def test_what_a_template_gets_wrong_is_named(template, old, new, message):
    template.write_text(TEMPLATE.replace(old, new))
    with pytest.raises(DataError, match=message):
        rendered(template, content())


def test_filters_write_numbers_in_their_units():
    written = {
        ("mm", 0.00178): "1.78 mm",
        ("mrad", 0.001): "1.00 mrad",
        ("um", 1e-6): "1.00 um",
        ("deg", 1.0): "57.30 deg",
        ("percent", 0.126): "13 %",
        ("fixed", 2.0): "2.00",
        ("short", 470.0): "470",
        ("digits", 0.012345): "0.0123",
        ("words", "gauss_newton"): "gauss newton",
        ("code", "none"): "`none`",
    }
    for (name, value), text in written.items():
        assert FILTERS[name](value) == text, name
    several = FILTERS["several"]
    assert [several("abc"), several("a"), several(["x", "y"]), several([])] == [
        *("a, b and c", "a", "x and y", "none")
    ]


@given(st.lists(st.sampled_from(["word", "", "- entry", "# Head", "| a |", "  more"]), max_size=9))
def test_unwrapping_keeps_words_and_order(lines):
    text = unwrapped("\n".join(lines))
    assert text.split() == " ".join(lines).split()
    assert unwrapped(text).rstrip("\n") == text.rstrip("\n")
    for line in text.splitlines():
        assert not line.startswith(("| a | ", "# Head "))


@pytest.fixture
def write(template, tmp_path, monkeypatch):
    """Write a report; says which figures were drawn."""
    drawn = []
    whole = reports._draw
    monkeypatch.setattr(reports, "_draw", lambda job: drawn.append(job[0].stem) or whole(job))
    folder = tmp_path / "reports"

    def run(given, **options):
        drawn.clear()
        write_report(folder, template, given, record=tmp_path / "data" / "report.json", **options)
        return sorted(drawn)

    run.folder = folder
    return run


def test_a_report_is_written_whole(write):
    write(content(files={"all.csv": "x\n"}), sources={"params.yaml: arm": "0a"})
    files = {p.relative_to(write.folder).as_posix() for p in write.folder.rglob("*.*")}
    assert files == {
        *("README.md", "metrics.json", "provenance.csv", "all.csv", "sub/errors.csv"),
        *("sub/errors.md", "figures/curve.png", "figures/other curve.png"),
    }
    text = (write.folder / "README.md").read_text()
    assert text.startswith(PAGE) and text.endswith("[provenance.csv](provenance.csv).\n")
    assert (write.folder / "sub/errors.csv").read_text() == "R\n1.00000\n"
    assert read_json(write.folder / "metrics.json") == {"a": 1.0}
    assert "params.yaml: arm,0a\n" in (write.folder / "provenance.csv").read_text()


def test_figures_are_drawn_again_only_if_they_changed(write):
    path = write.folder / "figures/curve.png"
    assert write(content()) == ["curve", "other curve"]
    first = file_checksum(path)
    assert write(content(metrics={"a": 2.0})) == []
    figures = content().figures
    assert write(content(figures=figures | {"curve": drawing([1.0, 2.5])})) == ["curve"]
    assert file_checksum(path) != first
    assert write(content(figures=figures | {"curve": drawing([1.0, 2.5], height=3.0)})) == ["curve"]
    assert write(content()) == ["curve"] and file_checksum(path) == first
    path.write_bytes(b"damaged")
    assert write(content()) == ["curve"] and file_checksum(path) == first


def test_processes_that_draw_get_whole_paths(template, tmp_path, monkeypatch):
    """They may have begun in another folder."""
    paths = []
    monkeypatch.setattr(reports, "_draw", lambda job: paths.append(job[0]) or job[0].touch())
    monkeypatch.chdir(tmp_path)
    (tmp_path / "made/figures").mkdir(parents=True)
    write_report(Path("made"), template, content(), record=Path("record.json"))
    assert [path.parent for path in paths] == [tmp_path / "made/figures"] * 2


def test_figures_of_other_code_are_drawn_again(write, monkeypatch):
    write(content())
    monkeypatch.setattr(reports, "_code", lambda module: "other")
    assert write(content()) == ["curve", "other curve"]


def test_what_is_no_longer_made_goes_and_nothing_else(write, template):
    write(content(files={"all.csv": "x\n"}))
    (write.folder / "mine.txt").write_text("kept")
    template.write_text(TEMPLATE.replace('{{ figure("curve", "A [curve]") }}', ""))
    figures = {"other curve": content().figures["other curve"]}
    write(content(figures=figures))
    left = {p.name for p in write.folder.rglob("*.*")}
    assert "mine.txt" in left and not {"all.csv", "curve.png"} & left


def test_nothing_is_written_of_a_report_with_a_fault(write):
    with pytest.raises(DataError, match="best"):
        write(content(values={}))
    assert not write.folder.exists()


def test_parts_of_a_report_join():
    both = content() | Content(metrics={"b": 2.0}, files={"f": ""})
    assert both.metrics == {"a": 1.0, "b": 2.0} and set(both.tables) == {"sub/errors"}


def test_a_digest_tells_data_apart():
    frame = pd.DataFrame({"x": [1.0, 2.0], "name": ["a", "b"]})
    alike = [frame, frame.copy(), pd.DataFrame(frame.to_dict("list"))]
    assert len({digest(f) for f in alike}) == 1
    others = [
        *(frame * 1, frame.assign(x=[1.0, 2.5]), frame.assign(name=["a", "c"]), frame[::-1]),
        *(frame.rename(columns={"x": "y"}), ["a", "b"], ["ab"], ("a", "b"), {"a": "b"}, None),
        *(1, 1.0, "1", chart, Axis("x"), Axis("x", 2.0)),
    ]
    assert len({digest(other) for other in others}) == len(others)
    assert digest(frame) == digest(frame * 1)
    with pytest.raises(DataError, match="object"):
        digest(object())
