"""What counts of a person's observation beside what photos say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.valuation.inputs import Observation

SAME = 0.005
"""Half a percent: shares that read alike."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """The last observation of an element up to the visit's day, and the share that it comes to beside the photos."""

    observation: Observation
    share: float
    contradicts: bool


def observed_elements(
    observations: Sequence[Observation], elements: Mapping[str, ElementProgress], visit: date
) -> dict[str, Observed]:
    """Return by GlobalId what counts of the last observation of each element; later ones than the visit don't yet."""
    last: dict[str, Observation] = {}
    for one in observations:
        if one.element in elements and one.day <= visit:
            before = last.get(one.element)
            last[one.element] = one if before is None or one.day >= before.day else before
    return {key: _beside_photos(one, elements[key]) for key, one in last.items()}


def _beside_photos(one: Observation, element: ElementProgress) -> Observed:
    """Weigh an observation against the photos' bounds: where the two contradict each other, the lesser counts.

    A person who looked after the photos may have seen more, or less. Photos after the person may show more: nobody
    then says that the person was wrong.
    """
    lower, upper = element.completion.lower, element.completion.upper
    seen = element.last_seen
    over = one.share > upper + SAME and seen is not None and seen >= one.day
    under = one.share < lower - SAME and (seen is None or seen <= one.day)
    if over:
        return Observed(observation=one, share=lower, contradicts=True)
    if seen is not None and seen > one.day:
        return Observed(observation=one, share=max(one.share, lower), contradicts=False)
    return Observed(observation=one, share=one.share, contradicts=under)


def observation_notes(
    observed: Mapping[str, Observed], elements: Mapping[str, ElementProgress], counts: bool
) -> list[Note]:
    """Return the notes on observations: those that photos contradict, and that none counts where that is so."""
    notes = [
        noted(
            Reason.OBSERVATION_CONTRADICTS,
            about(SubjectKind.ELEMENT, key),
            element=elements[key].name,
            share=one.observation.share,
            lower=elements[key].completion.lower,
            upper=elements[key].completion.upper,
            by=one.observation.by,
            day=one.observation.day.isoformat(),
            counted=one.share,
        )
        for key, one in observed.items()
        if one.contradicts
    ]
    if observed and not counts:
        notes.append(noted(Reason.OBSERVATION_SHOWN, about(SubjectKind.DESIGN), count=len(observed)))
    return notes
