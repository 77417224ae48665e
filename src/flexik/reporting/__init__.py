"""Tables, figures and pages of every case: the case gives numbers, this room makes files.

A case has `cases/NAME/report.py`, which turns results into tidy frames, tables, figures and values,
and `cases/NAME/page.md.j2`, which holds every sentence; cases/elastic_arm shows all of it.

- tables: `Table(frame, decimals)`, `table(rows, {"mean R (mm)": mm("mean_error")})`
- chart: `chart(Layer(...), ..., x=Axis(...), y=Axis(...), panel=, looks=, rules=)`: panels of
  lines, dots, steps, bands, bars, areas and texts; most figures are one call
- kinds: `strips` (dots or bars by category), `beside` (ours beside published), `distribution`,
  `sizes` (error against size), `sequences` (numbers in their order)
- plane: `maps` (a value over the plane, bright is bad), `space` (a mechanism of three dimensions)
- style: units, `looks` (one hue a method, `_selected` dashed), `shades` (by payload), PUBLISHED
- page: functions and filters of templates
- report: `draw(kind, ...)`, `Content`, and `write_case`, which draws in parallel what changed
"""
