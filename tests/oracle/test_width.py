"""The exact width against another engine: random fingers and objects, blades and needles between the planes."""

from collections import Counter

import pytest

from oracle.width import judge_places

FINGERS, PLACES = 40, 3
ORDERS = ("proximal-first", "together", "speeds")


@pytest.mark.parametrize(
    ("order", "fingers"),
    [*((order, FINGERS) for order in ORDERS), *((f"tilted {order}", FINGERS // 2) for order in ORDERS)],
)
def test_a_sample(order, fingers):
    found = [judged for seed in range(fingers) for judged in judge_places(seed, order, PLACES)]
    wrong = [sentence for judged in found for sentence in judged.wrong]
    counted = Counter(judged.kind for judged in found)
    assert not wrong, "\n".join(wrong)
    assert counted["contact"] > len(found) / 3, counted
    stages = sum(judged.stages for judged in found)
    assert sum(judged.grazing for judged in found) < 0.02 * stages
    # With speeds of their own, more stages end at joints that still move, of which the oracle says nothing.
    assert sum(judged.unresolved for judged in found) < (0.06 if "speeds" in order else 0.01) * stages
