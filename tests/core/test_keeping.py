"""What is kept by size is made once, and forgotten when it takes too much memory."""

import threading

from clench.core.caching.keeping import KeptBySize


def test_kept_by_size_forgets_what_was_asked_for_longest_ago() -> None:
    made: list[str] = []

    def make(text: str) -> str:
        made.append(text)
        return text

    kept = KeptBySize(6, len)
    for text in ("aaa", "bb", "aaa", "c", "dd", "aaa"):
        assert kept.get(text, lambda text=text: make(text)) == text
    assert made == ["aaa", "bb", "c", "dd"]
    assert kept.size == 6
    kept.get("eeeeeeee", lambda: make("eeeeeeee"))
    assert kept.size == 8
    kept.get("eeeeeeee", lambda: make("again"))
    kept.resize(100)
    kept.get("bb", lambda: make("bb"))
    assert made[4:] == ["eeeeeeee", "bb"]
    assert kept.size == 10


def test_threads_that_make_the_same_get_the_same() -> None:
    kept, together, found = KeptBySize(100, len), threading.Barrier(4), []

    def make() -> list[int]:
        together.wait()
        return [1, 2]

    threads = [threading.Thread(target=lambda: found.append(kept.get("key", make))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(each is found[0] for each in found)
    assert kept.size == 2
