"""Each hostile file is refused with one sentence and exit code 2, in a process with little memory and time."""

import pytest

from . import archives, data, meshes, models
from .apart import Outcome, read_apart

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
def outcomes(tmp_path_factory):
    """Return what comes of every file, by source and name; the files of a source are read when one is asked for."""
    found: dict[str, dict[str, Outcome]] = {}

    def of(source: str, name: str) -> Outcome:
        if source not in found:
            folder = tmp_path_factory.mktemp(source)
            files = []
            for number, (kind, write) in enumerate(SOURCES[source].values()):
                (folder / str(number)).mkdir()
                files.append((kind, write(folder / str(number))))
            found[source] = dict(zip(SOURCES[source], read_apart(files), strict=True))
        return found[source][name]

    return of


REFUSED = [(source, name) for source in ("models", "meshes", "data", "archives") for name in SOURCES[source]]


@pytest.mark.parametrize(("source", "name"), REFUSED, ids=[" ".join(pair) for pair in REFUSED])
def test_refused_with_one_sentence(outcomes, source, name):
    outcome = outcomes(source, name)
    assert outcome.code == 2, outcome
    sentences = [line for line in outcome.text.splitlines() if line.startswith("clench: error: ")]
    assert len(sentences) == 1, outcome
    assert outcome.text.splitlines()[-1] == sentences[0], outcome
    assert 40 < len(sentences[0]) < 2100, outcome
    assert "Traceback" not in outcome.text, outcome


@pytest.mark.parametrize("name", SOURCES["harmless"])
def test_read_without_harm(outcomes, name):
    outcome = outcomes("harmless", name)
    assert outcome.code in (0, 1, 2), outcome
    for sign in ("Traceback", "internal error", "root:", "Error:"):
        assert sign not in outcome.text.replace("clench: error:", ""), outcome
