"""The links of a tail's segments; 0 for a segment that is an arc."""

Links = int | tuple[int, ...] | None  # of all segments, or of each; None of a continuum


def links_of(pieces: int | list[int], kinds: tuple[str, ...]) -> Links:
    """Return the links of the segments, 0 of an arc; None of a continuum."""
    if "articulated" not in kinds:
        return None
    if isinstance(pieces, int):
        return pieces
    return tuple(n if kind == "articulated" else 0 for n, kind in zip(pieces, kinds, strict=True))


def words_of(links: Links, segments: int) -> str:
    """Return in words what a tail is made of."""
    if links is None:
        return f"{segments} continuum segments"
    if isinstance(links, int):
        return f"{segments} x {links} links"
    if all(links):
        return f"{segments} segments of {', '.join(map(str, links))} links"
    each = (f"{n} links" if n else "an arc" for n in links)
    return f"{segments} segments: {', '.join(each)}"
