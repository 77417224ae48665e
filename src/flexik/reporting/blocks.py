"""Named blocks of a text that a program keeps up to date."""

from flexik.errors import DataError


def replace_block(text: str, name: str, new: str) -> str:
    """`text` with `new` between its lines `<!-- flexik:NAME -->` and `<!-- /flexik:NAME -->`.

    Raises DataError unless `text` has each marker once, in this order, and `new` has neither.
    """
    start, end = f"<!-- flexik:{name} -->", f"<!-- /flexik:{name} -->"
    for marker in (start, end):
        if (count := text.count(marker)) != 1:
            raise DataError(f"expected the marker {marker} once, found it {count} times")
        if marker in new:
            raise DataError(f"the new text holds the marker {marker} itself")
    before, rest = text.split(start)
    if end not in rest:
        raise DataError(f"expected the marker {end} after {start}")
    after = rest.split(end)[1]
    # blank lines, or Markdown takes the text for part of the comment
    return f"{before}{start}\n\n{new.strip(chr(10))}\n\n{end}{after}"
