"""Name the face of a damaged mesh file that has a vertex that the file does not have."""

from __future__ import annotations

from collections.abc import Iterator


def wrong_face(data: bytes, suffix: str) -> str | None:
    """Return a clause about the first face with a vertex that is not there; None if no face has one.

    Args:
        data: of a text file. suffix: of its name, ".obj" or ".off"; no face is found in other files.
    """
    count, faces = {".obj": _obj_faces, ".off": _off_faces}.get(suffix, _no_faces)(data)
    for number, (line, corners) in enumerate(faces, start=1):
        for written, vertex in corners:
            if not 0 <= vertex < count:
                return f"face {number}, line {line}: names vertex {written}, but there are {count} vertices"
    return None


#: For each face, its line in the file, and its vertices: as the file writes them, and counted from 0.
_Faces = Iterator[tuple[int, list[tuple[int, int]]]]


def _no_faces(_: bytes) -> tuple[int, _Faces]:
    return 0, iter(())


def _obj_faces(data: bytes) -> tuple[int, _Faces]:
    """OBJ counts vertices from 1, and from the end with negative numbers."""
    lines = [line.split() for line in data.split(b"\n")]
    count = sum(1 for line in lines if line[:1] == [b"v"])

    def faces() -> _Faces:
        for number, words in enumerate(lines, start=1):
            if words[:1] == [b"f"]:
                written = [int(word) for word in (word.partition(b"/")[0] for word in words[1:]) if _is_whole(word)]
                yield number, [(index, index - 1 if index > 0 else count + index) for index in written]

    return count, faces()


def _off_faces(data: bytes) -> tuple[int, _Faces]:
    """OFF counts vertices from 0. Its first numbers are those of vertices and faces."""
    rows = [(n, line.partition(b"#")[0].split()) for n, line in enumerate(data.split(b"\n"), start=1)]
    rows = [(n, words) for n, words in rows if words and words != [b"OFF"]]
    sizes = [word for word in rows[0][1] if word != b"OFF"] if rows else []
    count = int(sizes[0]) if sizes and _is_whole(sizes[0]) else 0

    def faces() -> _Faces:
        for number, words in rows[1 + count :]:
            if _is_whole(words[0]):
                written = [int(word) for word in words[1 : 1 + int(words[0])] if _is_whole(word)]
                yield number, [(index, index) for index in written]

    return count, faces()


def _is_whole(word: bytes) -> bool:
    """Say whether a word is a whole number that is short enough to be an index."""
    return word.removeprefix(b"-").isdigit() and len(word) < 20
