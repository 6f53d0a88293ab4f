"""What persons bring to a valuation: observations, overrides, rates, variations, terms, and what was certified before.

None of it is ever mixed into a measured value.
"""

from dataclasses import dataclass, field
from datetime import date


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """What a person saw of an element on a day: how much of it stands."""

    element: str  # GlobalId
    day: date
    share: float  # 0..1
    by: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Override:
    """The share of an element's part of a cost line that a surveyor lets count, whatever photos say."""

    line: str  # the line's key
    element: str  # GlobalId, "" for what isn't measured of the line
    share: float  # 0..1
    reason: str
    by: str
    day: date | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RateChange:
    """A line's rate as a person wrote it into a workbook; it holds for all of the line."""

    line: str
    rate: float
    why: str  # and by whom


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """Work that was ordered beside the contract; `share` of it is done."""

    number: str
    text: str
    order: str  # who ordered it, and when
    unit: str
    quantity: float
    rate: float
    share: float  # 0..1
    by: str
    bill: int = 1  # which of the workbook's bills it belongs to, from 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """What is kept back of what is certified, and the tax on what is paid, both as shares."""

    retention: float = 0.0
    tax: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Paid:
    """What was certified of a line up to a certificate, in its unit and in cents."""

    line: str  # its key
    identification: str
    text: str
    unit: str
    rate: float
    quantity: float
    amount: float
    bill: int = 1
    contract: float = 0.0  # its contract quantity then; 0 in older results
    per_design: float = 0.0  # the most of it that stood for one of the design's quantity; 0 where nobody knows
    elements: dict[str, str] = field(default_factory=dict)  # by GlobalId: the names of those that it covered
    quantities: dict[str, float] = field(default_factory=dict)  # by GlobalId: their parts of the contract quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class BillTotals:
    """The sums of one bill up to a certificate, in cents."""

    bill: int
    currency: str
    work: float
    variations: float
    retention: float
    tax: float

    @property
    def net(self) -> float:
        """Return what is due before tax."""
        return self.work + self.variations - self.retention


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """A valuation that a person signed, as it stood in the workbook."""

    number: int
    visit: date
    signed_by: str
    signed_on: date
    totals: tuple[BillTotals, ...]
    photos: dict[str, str] = field(default_factory=dict, compare=False)  # as `ValuationInputs.photos`, when signed
    run: str = field(default="", compare=False)  # when the run was made that was current then, UTC; "": nobody knows
    digests: dict[str, str] = field(default_factory=dict, compare=False)  # sha256 of "workbook", "result", `FILES`


@dataclass(frozen=True, slots=True, kw_only=True)
class ValuationInputs:
    """All that is carried on from one workbook to the next. What was certified is read, never worked out again."""

    terms: Terms = Terms()
    count_observations: bool = False
    overrides: tuple[Override, ...] = ()
    rates: tuple[RateChange, ...] = ()
    variations: tuple[Variation, ...] = ()
    certificates: tuple[Certificate, ...] = ()  # in order
    before: tuple[BillTotals, ...] = ()  # the sums up to the last certificate, or as a person typed them
    paid: tuple[Paid, ...] = ()  # up to the last certificate
    paid_variations: dict[str, float] = field(default_factory=dict)  # by number, in cents, up to the last certificate
    project_terms: Terms | None = None  # what the project file said of them; None in older results
    signed_terms: Terms | None = None  # of the last certificate; None where there is none, and in older results
    photos: dict[str, str] = field(default_factory=dict)  # by visit and station: a digest of the two that were measured

    @property
    def number(self) -> int:
        """Return the number of the valuation that is being made."""
        return self.certificates[-1].number + 1 if self.certificates else 1


NO_INPUTS = ValuationInputs()
