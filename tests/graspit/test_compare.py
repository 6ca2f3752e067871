"""A few of the cases that GraspIt! computed; all of them with `python -m graspit.compare`."""

import pytest

from .compare import OBJECTS, SHARED, UNEXPLAINED, Comparison, load_hand, read_cases

CASES = 2


@pytest.mark.long
@pytest.mark.skipif(not SHARED.is_dir(), reason="needs ../shared/data/graspit")
@pytest.mark.parametrize("name", OBJECTS)
def test_a_sample_agrees_or_is_explained(name):
    comparison = Comparison(load_hand(SHARED / "hands" / "DLR"), name)
    rows = [row for case in read_cases(name, CASES) for row in comparison.compare(case)]
    assert len(rows) == 4 * CASES
    assert [row for row in rows if row.kind == UNEXPLAINED] == []
