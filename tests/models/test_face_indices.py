"""The face of a damaged file that names a vertex that is not there."""

import pytest

from clench.models.face_indices import wrong_face

CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
OFF = b"OFF\n# a comment\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("data", "suffix", "expected"),
    [
        (CORNERS + b"f 1 2 3\nf 1/1/1 2/2/2 9/9/9\n", ".obj", "face 2, line 5: names vertex 9"),
        (CORNERS + b"f 0 1 2\n", ".obj", "face 1, line 4: names vertex 0"),
        (CORNERS + b"f -1 -2 -4\n", ".obj", "face 1, line 4: names vertex -4"),
        (OFF + b"3 0 1 2\n3 0 1 3\n", ".off", "face 2, line 8: names vertex 3"),
        (OFF[4:].replace(b"# a comment", b"OFF") + b"3 0 1 -1\n", ".off", "face 1, line 6: names vertex -1"),
    ],
)
def test_the_first_wrong_face(data, suffix, expected):
    assert wrong_face(data, suffix) == f"{expected}, but there are 3 vertices"


@pytest.mark.parametrize(
    ("data", "suffix"),
    [
        (CORNERS + b"f -1 -2 -3\nf 1 2 x\n", ".obj"),
        (OFF + b"3 0 1 2\nend\n", ".off"),
        (b"", ".off"),
        (b"anything", ".ply"),
    ],
)
def test_no_face_is_wrong(data, suffix):
    assert wrong_face(data, suffix) is None
