"""Summary of a reproduction's numbers in sentences."""

from .expectation import Verdict, number_text
from .results import Reproduction
from .statement import Judged

LOST = (
    "The source's drawings and measured data are lost; only its text, equations and tables have survived. "
    "Where the text gives no number, a statement on an order or a trend is put into one, with a bound of "
    "ours. What needs the data, such as the overall differences of 9.6 % and 12.4 % between the source's "
    "model and its tests, cannot be recomputed."
)
TOLERANCES = (
    "How agreement is judged: constants and strains that the text quotes with three digits agree within 1 to "
    "2 %, measured or predicted values within 6 to 25 %. A trend holds if it does in every step, or nearly. "
    "Beyond that, and up to the second bound given, a statement agrees in part. Every tolerance stands "
    "beside its number."
)


def verdict_sentences(result: Reproduction) -> list[str]:
    """The summary, most important first."""
    counts, total = result.counts(), sum(result.counts().values())
    quoted = sum(j.statement.stated and j.statement.expected.quoted for j in result.judged)
    first = (
        f"Of {total} statements of the source that can be checked, our model agrees with "
        f"{counts[Verdict.agrees]}, agrees in part with {counts[Verdict.partly]} and disagrees with "
        f"{counts[Verdict.disagrees]}. {quoted} of them give a number; the others an order, a trend or a "
        "quality."
    )
    sentences = [first]
    forced = [
        j
        for j in result.judged
        if j.statement.stated and j.verdict is Verdict.agrees and j.statement.rests_on
    ]
    if forced:
        sentences.append(
            f"{len(forced)} of the agreements prove nothing by themselves: a constant that the source does "
            "not give, or prints wrong, was reconstructed or assumed with that statement in view. They are "
            "marked."
        )
    against = [j for j in result.judged if j.statement.stated and j.verdict is Verdict.disagrees]
    if against:
        itself = sum(j.statement.contradicted for j in against)
        sentences.append(
            f"In {itself} of the {len(against)} disagreements the source contradicts itself or cannot be "
            f"computed as printed; in the other {len(against) - itself} the model leaves something out or "
            "computes it in another way. All are listed and explained."
        )
    extra = result.counts(stated=False)
    if sum(extra.values()):
        sentences.append(
            f"{sum(extra.values())} expectations that we add, which the text does not state, are counted "
            f"apart: {extra[Verdict.agrees]} agree, {extra[Verdict.partly]} in part, "
            f"{extra[Verdict.disagrees]} not."
        )
    return sentences


def remark(judged: Judged) -> str:
    """Remark on a verdict: further numbers, constants that it rests on, reason of a difference."""
    parts = [judged.found.detail]
    if judged.reason:
        parts.append(f"why: {judged.reason}")
    if judged.statement.rests_on:
        parts.append(f"not independent: {judged.statement.rests_on}")
    if not judged.statement.stated:
        parts.append("not stated in the text")
    return "; ".join(part for part in parts if part)


def one_line(judged: Judged) -> str:
    """A statement, both numbers and the verdict, for a terminal."""
    statement = judged.statement
    unit = "" if statement.unit == "1" else f" {statement.unit}"
    origin = "source" if statement.expected.quoted else "our bound"
    numbers = f"{origin} {statement.expected.source}{unit}, ours {number_text(judged.found.value)}{unit}"
    return f"{statement.number:8s} {judged.verdict.value:10s} {statement.says}: {numbers}"
