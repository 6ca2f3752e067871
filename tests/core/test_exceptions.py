"""Messages are one line that can be printed."""

from clench.core.exceptions import ClenchError, FileError, UnknownNameError


def test_a_message_is_one_line():
    assert str(FileError("a\nb.urdf", "no such\tfile.")) == "a b.urdf: no such file."


def test_what_cannot_be_printed_is_escaped():
    assert str(ClenchError("name 'a\0b\u202e' is odd")) == r"name 'a\x00b\u202e' is odd"
    assert str(ClenchError("die Größe 日本")) == "die Größe 日本"


def test_a_long_name_is_cut_in_the_middle():
    text = str(UnknownNameError("joint", "x" * 9000, "hand 'h'", ["index"]))
    assert len(text) < 2100
    assert text.startswith("Joint 'xxx")
    assert text.endswith("Joints: index.")


def test_a_name_of_another_kind_has_no_guess():
    assert str(UnknownNameError("joint", 1, "hand 'h'", ["index"])) == "Joint '1' is not in hand 'h'. Joints: index."  # type: ignore[arg-type]
