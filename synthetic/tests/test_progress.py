from itertools import pairwise

import pytest

from asbuilt_synthetic.layout import design
from asbuilt_synthetic.progress import progress


@pytest.mark.parametrize("seed", range(8))
def test_what_stands_at_one_visit_stands_at_the_next(seed):
    b = design(seed)
    states = [progress(b, v) for v in range(4)]
    for before, after in pairwise(states):
        assert all(before.fraction[g] <= after.fraction[g] for g in before.fraction)


@pytest.mark.parametrize("seed", range(8))
def test_the_first_floor_rises_only_on_its_slab_and_the_slab_only_on_finished_supports(seed):
    b = design(seed)
    for visit in range(3):
        state = progress(b, visit)
        slabs = {s.zone for s in b.elements if s.ifc_class == "IfcSlab" and s.storey == 1 and state.stands(s)}
        for e in b.vertical:
            if e.storey == 1 and state.stands(e):
                assert e.zone in slabs
            if e.storey == 0 and e.zone in slabs and e.zone == 0:
                assert state.fraction[e.global_id] == 1.0


def test_every_state_occurs_and_part_heights_are_clear_of_the_ends():
    values = [f for seed in range(10) for v in (0, 1) for f in progress(design(seed), v).fraction.values()]
    parts = [f for f in values if 0 < f < 1]
    assert 0.0 in values and 1.0 in values and len(parts) > 20
    assert min(parts) >= 0.25 and max(parts) <= 0.85


def test_on_a_shuttered_site_thick_formwork_stands_round_all_that_is_absent_and_nothing_else_changes():
    for seed in range(4):
        b = design(seed)
        plain, shuttered = progress(b, 1), progress(b, 1, shuttered=True)
        absent = {e.global_id for e in b.vertical if plain.fraction[e.global_id] == 0.0 and e.storey == 0}
        assert shuttered.fraction == plain.fraction and absent <= shuttered.formwork.keys() and not shuttered.cages
        assert all(0.04 <= form.panel_m <= 0.10 for form in shuttered.formwork.values())
        assert all(form.panel_m == 0.021 for form in plain.formwork.values())


def test_formwork_and_cages_stand_only_where_nothing_is_poured():
    for seed in range(8):
        state = progress(design(seed), 1)
        assert all(state.fraction[g] == 0.0 for g in {*state.formwork, *state.cages})
