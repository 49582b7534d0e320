"""Which thresholds of the diagnosis ever decide: comparisons that would turn out differently without them.

    python benchmarks/decisive_thresholds.py CAMPAIGN... --out out/decisive [--minutes 4]
    python benchmarks/decisive_thresholds.py CAMPAIGN... --out out/other --other chance.deviations=4

Every threshold of one number becomes a `Probe`: a number that carries a relaxed value beside its own.
Relaxed is 0 for a minimum (minus 1e9 for logarithms) and 1e9 for a maximum. With `--other` it is the value
that is given: comparisons that turn are those between both values. Arithmetic keeps both. A comparison
returns what the own value says, and notes whether the relaxed one says otherwise. So one diagnosis tests all
thresholds at once, and its result is what it always is. NumPy functions that turn a probe into an array lose
it, so what is never compared here may still decide. A file is left for every
campaign; those that are there are not run again.
"""

import argparse
import collections
import json
import operator
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

COMPARED: collections.Counter[str] = collections.Counter()
TURNED: collections.Counter[str] = collections.Counter()


def note(names: Iterable[str], turned: bool) -> None:
    """Count a comparison of some thresholds."""
    for name in names:
        COMPARED[name] += 1
        TURNED[name] += int(turned)


class Probe(float):
    """A number that carries a relaxed value, and the names of the thresholds that it is made of."""

    def __new__(cls, own: float, relaxed: float, names: Iterable[str]) -> "Probe":
        made = super().__new__(cls, own)
        made.own, made.relaxed, made.names = float(own), float(relaxed), frozenset(names)
        return made

    def __hash__(self) -> int:
        return hash(self.own)

    def __reduce__(self) -> tuple:
        return float, (self.own,)

    def __neg__(self) -> "Probe":
        return Probe(-self.own, -self.relaxed, self.names)

    def __abs__(self) -> "Probe":
        return Probe(abs(self.own), abs(self.relaxed), self.names)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **more: Any) -> Any:
        """What NumPy does with both values."""
        names = names_of(inputs)
        more = {k: tuple(map(own, v)) if isinstance(v, tuple) else own(v) for k, v in more.items()}
        found = getattr(ufunc, method)(*map(own, inputs), **more)
        if more.get("out"):
            return found
        with np.errstate(all="ignore"):
            other = getattr(ufunc, method)(*map(relaxed, inputs), **more)
        if np.ndim(found) == 0 and np.asarray(found).dtype.kind == "f" and np.ndim(other) == 0:
            return Probe(float(found), float(other), names)
        if np.asarray(found).dtype.kind == "b" or ufunc in (np.minimum, np.maximum):
            note(names, not np.array_equal(found, other))
        return found


def own(x: Any) -> Any:
    """A probe's own value; anything else as it is."""
    return x.own if isinstance(x, Probe) else x


def relaxed(x: Any) -> Any:
    """A probe's relaxed value; anything else as it is."""
    return x.relaxed if isinstance(x, Probe) else x


def names_of(parts: Iterable[Any]) -> frozenset[str]:
    """Names of all thresholds in some numbers."""
    return frozenset().union(*(x.names for x in parts if isinstance(x, Probe)))


def _comparison(compare: Callable[[Any, Any], bool]) -> Callable[[Probe, Any], bool]:
    def compared(self: Probe, other: Any) -> bool:
        if isinstance(other, np.ndarray):
            return NotImplemented
        found = bool(compare(own(self), own(other)))
        note(names_of((self, other)), found != bool(compare(relaxed(self), relaxed(other))))
        return found

    return compared


def _arithmetic(calculate: Callable[[Any, Any], float], swapped: bool) -> Callable[[Probe, Any], Probe]:
    def calculated(self: Probe, other: Any) -> Probe:
        if not isinstance(other, int | float | np.floating | np.integer):
            return NotImplemented
        pair = (other, self) if swapped else (self, other)
        try:
            without = calculate(*map(relaxed, pair))
        except (ZeroDivisionError, OverflowError):
            without = float("nan")
        without = float("nan") if isinstance(without, complex) else without
        return Probe(calculate(*map(own, pair)), without, names_of(pair))

    return calculated


for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Probe, f"__{_name}__", _comparison(getattr(operator, _name)))
for _name in ("add", "sub", "mul", "truediv", "pow"):
    setattr(Probe, f"__{_name}__", _arithmetic(getattr(operator, _name), swapped=False))
    setattr(Probe, f"__r{_name}__", _arithmetic(getattr(operator, _name), swapped=True))


def probe(settings: Any, others: Mapping[str, float] | None = None) -> list[str]:
    """Make thresholds of one number in settings probes; their names.

    Args:
        settings: all thresholds.
        others: relaxed value by name. If it is None, every minimum and maximum is relaxed.
    """
    from fitting.diagnose.settings import thresholds_of

    made = []
    for one in thresholds_of(settings):
        asked = one.sentence.startswith(("Minimum", "Maximum")) if others is None else one.name in others
        if isinstance(one.value, float) and asked:
            group, _, field = one.name.partition(".")
            least = -1e9 if one.unit == "nat" else 0.0
            other = least if one.sentence.startswith("Minimum") else 1e9
            other = other if others is None else others[one.name]
            object.__setattr__(getattr(settings, group), field, Probe(one.value, other, {one.name}))
            made.append(one.name)
    return made


def table(folder: Path) -> str:
    """How often each threshold was compared, and how often its comparison turned, over all campaigns."""
    compared, turned, cases = collections.Counter(), collections.Counter(), collections.Counter()
    files = sorted(folder.glob("*.json"))
    for path in files:
        found = json.loads(path.read_text(encoding="utf-8"))
        compared.update(found["compared"])
        turned.update(found["turned"])
        cases.update([name for name, count in found["turned"].items() if count])
    head = "| Threshold | Compared | Turned | In campaigns |"
    lines = [f"{len(files)} campaigns", "", head, "|---|---|---|---|"]
    for name in sorted(compared, key=lambda name: (cases[name], name)):
        lines.append(f"| `{name}` | {compared[name]} | {turned[name]} | {cases[name]} |")
    return "\n".join(lines)


def main() -> None:
    """Diagnose campaigns with probes, and print the table."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("campaigns", nargs="*", type=Path)
    arguments.add_argument("--out", type=Path, required=True)
    arguments.add_argument("--minutes", type=float, default=60.0, help="no campaign is begun later than that")
    arguments.add_argument("--other", nargs="+", metavar="NAME=VALUE", help="relaxed values of these alone")
    given = arguments.parse_args()
    from pneusma_jax import enable_float64

    enable_float64()
    from fitting.data.recordings import read_campaign
    from fitting.diagnose import diagnose
    from fitting.diagnose.settings import DEFAULT

    others = given.other and {name: float(x) for name, _, x in (one.partition("=") for one in given.other)}
    known = probe(DEFAULT, others)
    if unknown := sorted(set(others or ()) - set(known)):
        arguments.error(f"no threshold of one number: {', '.join(unknown)}")
    given.out.mkdir(parents=True, exist_ok=True)
    begun = time.time()
    for campaign in given.campaigns:
        path = given.out / f"{campaign.name}.json"
        if path.exists() or time.time() - begun > 60.0 * given.minutes:
            continue
        COMPARED.clear(), TURNED.clear()
        conclusion = diagnose(read_campaign(campaign), seed=1)
        found = {"named": [f.slug for f in conclusion.found], "compared": COMPARED, "turned": TURNED}
        path.write_text(json.dumps(found), encoding="utf-8")
    print(table(given.out))


if __name__ == "__main__":
    main()
