"""Each hostile file is refused with one sentence and exit code 2, in a process with little memory and time."""

import pytest

from . import archives, data, meshes, models
from .apart import Outcome, reading_apart

SOURCES = {
    "models": {name: ("hand", write) for name, write in models.REFUSED.items()},
    "meshes": {name: ("thing", write) for name, write in meshes.REFUSED.items()},
    "data": data.REFUSED,
    "archives": archives.REFUSED,
    "harmless": {
        **{name: ("hand", write) for name, write in models.HARMLESS.items()},
        **{name: ("thing", write) for name, write in meshes.HARMLESS.items()},
        **data.HARMLESS,
    },
}


@pytest.fixture(scope="module")
def server():
    """Give what reads a file in a process of its own."""
    with reading_apart() as read:
        yield read


@pytest.fixture
def outcome_of(server, tmp_path):
    """Return a function that writes a file, and returns what comes of it."""

    def of(source: str, name: str) -> Outcome:
        kind, write = SOURCES[source][name]
        return server(kind, write(tmp_path))

    return of


REFUSED = [(source, name) for source in ("models", "meshes", "data", "archives") for name in SOURCES[source]]


@pytest.mark.parametrize(("source", "name"), REFUSED, ids=[" ".join(pair) for pair in REFUSED])
def test_refused_with_one_sentence(outcome_of, source, name):
    outcome = outcome_of(source, name)
    assert outcome.code == 2, outcome
    sentences = [line for line in outcome.text.splitlines() if line.startswith("clench: error: ")]
    assert len(sentences) == 1, outcome
    assert outcome.text.splitlines()[-1] == sentences[0], outcome
    assert 40 < len(sentences[0]) < 2100, outcome
    assert "Traceback" not in outcome.text, outcome


@pytest.mark.parametrize("name", SOURCES["harmless"])
def test_read_without_harm(outcome_of, name):
    outcome = outcome_of("harmless", name)
    assert outcome.code in (0, 1, 2), outcome
    for sign in ("Traceback", "internal error", "root:", "Error:"):
        assert sign not in outcome.text.replace("clench: error:", ""), outcome
