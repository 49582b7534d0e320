"""Options that nothing used: the reason, and the option that was probably intended."""

from ..recordings import schema
from .making import Making

_MADE_OF = {"strain": ("stretch", "true_strain", "elongation"), "stress": ("true_stress", "force")}
_SIZES_FOR = {
    "gauge_length_mm": "strain", "area_mm2": "stress", "diameter_mm": "stress", "width_mm": "stress",
    "thickness_mm": "stress",
}  # fmt: skip


def mark_used(making: Making, columns: dict) -> None:
    """Record the used options that name a quantity, from the sources of the recording."""
    sources = {
        schema.quantity_and_unit(name)[0]
        for name in columns
        if name in schema.KINDS[making.kind].columns.known
    }
    raw = (sources & making.raw) | making.sources
    derived = sources & making.channels.keys()  # a constant is no channel, and nothing scales it
    if making.options.speed is not None and "elongation" in raw | derived:
        making.use("--speed")
    for option, table, used in (
        ("--map", making.options.columns, raw), ("--unit", making.options.units, raw),
        ("--scale", making.options.scales, raw | derived),
    ):  # fmt: skip
        for name in table:
            if name in used:
                making.use(option, name)


def explain(making: Making) -> None:
    """Record for each unused option the reason, and the option that was probably intended."""
    for option, name in making.options.stated():
        if (option, name) not in making.options.used.names:
            making.options.used.why[option, name] = _why(making, option, name)


def _why(making: Making, option: str, name: str) -> str:
    text = f"{option} {name}".strip()
    channels, kind = making.channels, making.kind
    if option in ("--unit", "--scale", "--map"):
        if name in making.options.constants:
            return f"{text}: {name} is what --constant states, in its unit; state the right number there"
        made = channels[name].made if name in channels and name not in making.raw else ""
        source = next((q for q in _MADE_OF.get(name, ()) if q in making.sources), None)
        if made and source:
            return f"{text}: {name} is made here ({made}); say {option} {source}=... instead"
        if name in channels:
            family = next((f for f, parts in _MADE_OF.items() if name in parts and f in channels), None)
            if family and schema.KINDS[kind].strained:
                return (
                    f"{text}: {family} is read from {channels[family].label!r}, so {channels[name].label!r}"
                    " is of no use; say"
                    f" {option} {family}=... instead, or leave it out"
                )
            return f"{text}: a recording of kind {kind} has no {name}; leave it out, or state another --kind"
        own_columns = making.raw
        names = ", ".join(sorted(own_columns))
        return f"{text}: nothing in this file is read as {name}; read are {names}: is one of these meant?"
    if option == "--dimension":
        return _why_dimension(making, text, name)
    if option == "--constant":
        names = ", ".join(schema.KINDS[kind].columns.known)
        return f"{text}: a recording of kind {kind} has no {name}; it has {names}"
    if option == "--subtract" and name in making.options.constants:
        return f"{text}: {name} is what --constant states; state the right number there"
    if option == "--subtract":
        names = ", ".join(sorted(channels))
        return f"{text}: nothing in this file is read as {name}; read are {names}"
    if option == "--circuit":
        return (
            f"{text}: no voltage is converted to a resistance here (name one with --map voltage=..., kind"
            " spring or actuator)"
        )
    if option == "--speed":
        return f"{text}: a recording of kind {kind} is made of no displacement here; leave the option out"
    if option == "--interval":
        return f"{text}: the file has a clock of its own, or needs none; leave the option out"
    if option == "--slack" and kind == "wire":
        return (
            f"{text}: the temperature of this wire changes, so that a flat start may be the alloy's own"
            " doing. Take off a known zero with --subtract strain=... or --subtract stress_MPa=..."
        )
    if option == "--slack":
        return (
            f"{text}: a recording of kind {kind} has no stroke that could begin slack (elastomer, wire and"
            " spring have)"
        )
    return (
        f"{text}: it turns strain and stress of a coupon or wire, and this is of kind {kind}; turn a sign"
        " with --scale QUANTITY=-1"
    )


def _why_dimension(making: Making, text: str, name: str) -> str:
    made = _SIZES_FOR.get(name)
    channel = making.channels.get(made) if made else None
    if channel is not None and schema.KINDS[making.kind].strained:
        needed = "extension" if made == "strain" else "load"
        quantity = "elongation" if made == "strain" else "force"
        if channel.made:
            return f"{text}: {made} is {channel.made}; leave the option out"
        return (
            f"{text}: {made} is read from {channel.label!r} and there is no {needed} to divide; name one"
            f" with --map {quantity}=...,"
            " or leave the option out"
        )
    if name == "wire_diameter_mm":
        return f"{text}: that is the wire of a spring; of this specimen say --dimension diameter_mm=..."
    return f"{text}: a recording of kind {making.kind} has no use for it; leave the option out"
