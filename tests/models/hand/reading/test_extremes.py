"""Numbers that are no hand's are refused by name."""

import pytest

import clench
from fuzz.originals import MJCF, URDF, link_stl


def load(folder, text, suffix=".urdf"):
    (folder / "link.stl").write_bytes(link_stl())
    model = folder / f"pincer{suffix}"
    model.write_text(text)
    return clench.Hand.load(model)


def test_what_they_start_from_loads(tmp_path):
    assert [f.name for f in load(tmp_path, URDF).fingers] == ["index", "thumb"]
    assert len(load(tmp_path, MJCF, ".xml").fingers) == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('lower="-0.2" upper="1.5"', 'lower="-0.2" upper="1e10"', r"joint 'thumb_a' has limits -0.2 to 1e\+10 rad"),
        (
            'lower="-0.2" upper="1.5"',
            'lower="-0.2" upper="1e300"',
            r"<limit> of 'thumb_a': upper '1e300'",
        ),
        ('xyz="0.04 0 0"', 'xyz="1e12 0 0"', "its place of link 'index_distal' has lengths that are not finite"),
        ('multiplier="0.8"', 'multiplier="5e-324"', "joint 'index_b' is coupled by a ratio of 4.94066e-324"),
        (
            '<axis xyz="0 -1 0"/><limit lower="-0.2"',
            '<axis xyz="0 1e308 0"/><limit lower="-0.2"',
            r"<axis> of 'thumb_a': xyz '0 1e308 0'",
        ),
        ('mass value="0.02"', 'mass value="inf"', "mass of link 'index_proximal' is 'inf'"),
        ('sphere radius="0.01"', 'sphere radius="1e10"', "a shape of link 'thumb' has lengths"),
    ],
)
def test_extreme_numbers(tmp_path, old, new, message):
    assert old in URDF
    with pytest.raises(clench.ClenchError, match=message):
        load(tmp_path, URDF.replace(old, new))


def test_an_infinite_velocity_is_no_limit(tmp_path):
    hand = load(tmp_path, URDF.replace('velocity="3"', 'velocity="inf"'))
    assert [j.velocity for j in hand.joints] == [None] * 3
