"""The benchmark that switches rules off: every rule is there to be switched off, and comes back."""

from __future__ import annotations

import pytest

from benchmarks.site.rules import RULES, Element, Rule, changed, within, without, wrongly

A = Element(
    key="a", state="part", true_state="part", lower=0.2, upper=0.6, best=0.4, true=0.4, visible=True, unseen=False
)
WRONG = Element(
    key="a", state="complete", true_state="part", lower=0.9, upper=1.0, best=1.0, true=0.4, visible=True, unseen=False
)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_a_rule_is_switched_off_for_a_while_and_comes_back(rule: Rule) -> None:
    kept = getattr(rule.module, rule.function)
    with without(rule):
        assert getattr(rule.module, rule.function) is rule.instead
    assert getattr(rule.module, rule.function) is kept


def test_what_goes_wrong_without_a_rule_is_named() -> None:
    assert within(A) and not within(WRONG) and wrongly(WRONG) and not wrongly(A)
    lines = changed(RULES[0], [A], [WRONG])
    assert "states +0 -1 of 1, truths +0 -1, bounds changed 1" in lines[0].figure
    assert lines[1].figure == "part -> complete, true part"
