"""Tables, figures and pages of every case: the case gives numbers, this room makes files.

A case has `cases/NAME/report.py`, which turns results into tidy frames, tables, figures and values,
and `cases/NAME/page.md.j2`, which holds every sentence. Rooms inside:

- tables: `Table(frame, decimals)`, `table(rows, {"mean R (mm)": mm("mean_error")})`
  -> CSV, Markdown
- chart: `chart(Layer(...), ..., x=Axis(...), y=Axis(...), panel=, looks=, rules=)`: panels of
  lines, dots, steps, bands, bars, areas (bodies) and texts; most figures are one call
- kinds: `strips` (dots or bars by category), `beside` (ours beside published), `distribution`,
  `sizes` (error against size), `sequences` (numbers in their order)
- plane: `maps` (a value over the plane, bright is bad), `space` (a mechanism of three dimensions)
- style: units, `looks` (one hue a method, `_selected` dashed), `shades` (by payload), PUBLISHED
- page: the template's functions and filters
- report: `draw(kind, ...)` and `write_report`, which draws in parallel what changed

Example::

    LOOKS = style.looks(("none", *methods), suffixes=("_selected",))
    errors = pd.concat(...)                       # columns method, payload, error (m), ...
    tables = {
        "errors": table(statistics, {"method": "method", "mean R (mm)": mm("mean_error")}),
    }
    figures = {
        "distribution": draw(
            kinds.distribution, errors, "error", "method", Axis("error (mm)", MM, log=True),
            looks=LOOKS,
        ),
        "training": draw(
            chart,
            Layer(curves, "seconds", "error", "-", hue="trainer"),
            x=Axis("time (s)", log=True),
            y=Axis("root mean square error (1)", log=True),
            rules=[Rule("y", 0.02, "published")],
        ),
    }
    content = Content(
        tables, figures, {"combined.mean_error_mm": 1.78}, {"n": 125, "best": best, "n_failed": 0}
    )
    write_report(
        Path("reports/arm"), Path(__file__).with_name("page.md.j2"), content | other_content,
        sources=made_from(section, [machine_file]), record=Path("data/arm/report.json"),
    )

with the template::

    # Arm

    `{{ best.method }}` errs by {{ best.mean_error | mm }} on average.

    {% call table("errors") %}
    Errors over {{ n }} conditions.
    - Payload outside the training grid's {{ payload | join(" to ") }} kg.
    {% if n_failed %}
    - Failed conditions are included: {{ n_failed }}.
    {% endif %}
    {% endcall %}

    {{ figure("distribution", "Distribution of the errors.") }}
"""
