"""Tables of constants of a campaign's base model: their names, their sources, and who named them."""

from collections.abc import Collection
from dataclasses import dataclass

from fitting.data.recordings import Campaign
from fitting.specimens import priors, specimen_of
from fitting.specimens.silicones import DEFAULT

KEYS = {"alloy": "alloy", "silicone": "material"}
"""Key of `[geometry]` that names a table, by the kind of the table."""


@dataclass(frozen=True)
class BaseTable:
    """A table of constants of the base model.

    Attributes:
        kind: `alloy` or `silicone`.
        name: name of the table.
        description: one sentence of the table.
        citation: source of its numbers; empty where it states none.
        stated: the recordings, or a design that they state, name the table.
        identified: the constants are identified from the recordings; the table is where that begins.
    """

    kind: str
    name: str
    description: str
    citation: str
    stated: bool
    identified: bool

    @property
    def text(self) -> str:
        """Sentences on the table, for a reader who did not choose it."""
        key = KEYS[self.kind]
        source = self.citation or "its table states no source"
        words = self.description.rstrip(".")
        known = f"{self.name}: {words} ({source})" if words else f"{self.name} ({source})"
        if self.identified:
            return f"The {self.kind} is identified from these recordings. That begins at the table {known}."
        if self.stated:
            return f"The {self.kind} has the constants of {known}, as stated."
        return (
            f"The {self.kind} has the constants of {known}. No recording states its {key}, so the "
            f'source\'s was assumed: state yours as {key} under [geometry], or {key} = "fit".'
        )


def base_tables(campaign: Campaign, kind: str, replaced: Collection[str] = ()) -> tuple[BaseTable, ...]:
    """The tables whose constants the base model of a campaign has.

    Args:
        campaign: recordings of one kind.
        kind: kind of the recordings.
        replaced: keys of `[geometry]` in whose place a table was fitted first.
    """
    found, specimen = [], specimen_of(kind)
    begins = {"alloy": specimen.new_alloy, "silicone": DEFAULT}
    for table in (table for table in specimen.tables if table in KEYS):
        key = KEYS[table]
        recordings = [r for r in campaign.recordings if key in r.full_geometry()]
        if not recordings or key in replaced:
            continue
        identified = str(recordings[0].table(key)) == priors.FIT
        calibration, _ = priors.table_of(campaign, key, begins[table] if identified else None)
        stated = any(key in r.geometry or "design" in r.geometry for r in recordings)
        found.append(
            BaseTable(
                table, calibration.name, calibration.description, calibration.text.get("citation", ""),
                stated, identified,
            )
        )  # fmt: skip
    return tuple(found)
