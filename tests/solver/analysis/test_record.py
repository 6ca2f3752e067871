"""The record: what goes in comes out equal, in one transaction, and foreign files are refused."""

from __future__ import annotations

import os
import sqlite3
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clench.core.exceptions import ClenchError, FileError, UnknownNameError
from clench.solver.analysis.record import SCHEMA_VERSION, Record
from clench.solver.solution import GraspSolution, SolutionStatus
from handmade import make_solution


def test_append_and_read_back_equal(tmp_path: Path, solution: GraspSolution) -> None:
    with Record(tmp_path / "r.db") as record:
        entry_id = record.append(solution)
        assert record.read(entry_id) == solution
    with Record(tmp_path / "r.db") as record:
        again = record.read(entry_id)
        assert again == solution
        assert len(again.fingers["index"].candidates) == 3
        assert len(record) == 1


def test_find_by_columns_newest_first(tmp_path: Path) -> None:
    with Record(tmp_path / "r.db") as record:
        ids = record.extend(
            [
                make_solution(),
                make_solution(hand="other"),
                make_solution(status=SolutionStatus.NO_CONTACT, seed=None),
                make_solution(object="mug", geometry_hash="ffff"),
            ]
        )
        assert [e.id for e in record.find()] == ids[::-1]
        assert [e.id for e in record.find(hand="pincer", object="ball")] == [ids[2], ids[0]]
        assert [e.id for e in record.find(status=SolutionStatus.NO_CONTACT)] == [ids[2]]
        assert [e.id for e in record.find(status="partial", limit=1)] == [ids[3]]
        assert [e.id for e in record.find(geometry_hash="ffff", seed=7)] == [ids[3]]
        assert record.find(hand="nobody") == []
        entry = record.find(object="mug")[0]
        assert entry.touching_fingers == 1
        assert entry.status is SolutionStatus.PARTIAL
        assert entry.seed == 7
        assert entry.time.endswith("+00:00")
        with pytest.raises(UnknownNameError, match="Status 'good' is not in solutions"):
            record.find(status="good")


def test_names_with_quotes_are_data(tmp_path: Path) -> None:
    name = "x' OR '1'='1"
    with Record(tmp_path / "r.db") as record:
        record.append(make_solution())
        assert record.find(hand=name) == []
        record.append(make_solution(hand=name))
        assert len(record.find(hand=name)) == 1


def test_extend_is_all_or_none(tmp_path: Path) -> None:
    with Record(tmp_path / "r.db") as record:
        record.append(make_solution())
        with pytest.raises(ClenchError, match=r"joint_angles\.a: is not a finite number"):
            record.extend([make_solution(), make_solution(joint_angles={"a": np.nan})])
        assert len(record) == 1
        record.append(make_solution())
        assert len(record) == 2


def test_unknown_id(tmp_path: Path) -> None:
    with Record(tmp_path / "r.db") as record:
        with pytest.raises(UnknownNameError, match=r"Solve '3' is not in record .* It has no solves"):
            record.read(3)
        record.append(make_solution())
        with pytest.raises(UnknownNameError, match=r"Solves: 1 to 1\."):
            record.read(3)


def test_journal_and_schema_version(tmp_path: Path) -> None:
    with Record(tmp_path / "r.db") as record:
        record.append(make_solution())
    raw = sqlite3.connect(tmp_path / "r.db")
    assert raw.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    assert raw.execute("PRAGMA user_version").fetchone() == (SCHEMA_VERSION,)
    raw.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    raw.close()
    with pytest.raises(FileError, match=f"a record of version {SCHEMA_VERSION + 1}; this program reads up to"):
        Record(tmp_path / "r.db")


def test_foreign_files_are_refused_untouched(tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("not a database at all, but long enough to have a header " * 30)
    before = text.read_bytes()
    with pytest.raises(FileError, match=r"notes\.txt: not a record of solves: the file is no SQLite database"):
        Record(text)
    assert text.read_bytes() == before
    foreign = tmp_path / "foreign.db"
    other = sqlite3.connect(foreign)
    other.execute("CREATE TABLE songs (name TEXT)")
    other.commit()
    other.close()
    before = foreign.read_bytes()
    with pytest.raises(FileError, match=r"foreign\.db: a SQLite file of another program"):
        Record(foreign)
    assert foreign.read_bytes() == before
    with pytest.raises(FileError, match=r"no folder"):
        Record(tmp_path / "absent" / "r.db")
    with pytest.raises(FileError, match=r"cannot be used \(unable to open"):
        Record(tmp_path)


def test_damaged_record(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    with Record(path) as record:
        record.extend(make_solution() for _ in range(50))
    raw = bytearray(path.read_bytes())
    raw[4096:] = b"\x5a" * (len(raw) - 4096)
    path.write_bytes(raw)
    with pytest.raises(FileError, match="the record is damaged"), Record(path) as record:
        record.find()


def test_damaged_document(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    with Record(path) as record:
        entry_id = record.append(make_solution())
    raw = sqlite3.connect(path)
    raw.execute("UPDATE solves SET document = substr(document, 1, 100)")
    raw.commit()
    raw.close()
    with Record(path) as record, pytest.raises(FileError, match=r"r\.db, solve 1: not JSON"):
        record.read(entry_id)


def test_closed_record(tmp_path: Path) -> None:
    record = Record(tmp_path / "r.db")
    record.close()
    with pytest.raises(FileError, match="the record is closed"):
        record.append(make_solution())


def test_two_writers_at_once(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    Record(path).close()
    failures: list[BaseException] = []

    def write(seed: int) -> None:
        try:
            with Record(path) as record:
                for _ in range(20):
                    record.append(replace(make_solution(), seed=seed))
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=write, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    with Record(path) as record:
        assert len(record.find(seed=1)) == len(record.find(seed=2)) == 20


def test_many_solutions_are_written_in_one_transaction_and_found_by_an_index(tmp_path: Path) -> None:
    with Record(tmp_path / "r.db") as record:
        statements: list[str] = []
        record._connection.set_trace_callback(statements.append)
        ids = record.extend(make_solution(seed=i) for i in range(20))
        assert [text.split()[0] for text in statements] == ["BEGIN", *["INSERT"] * 20, "COMMIT"]
        assert record.read(ids[12]).seed == 12
        statements.clear()
        assert len(record.find(seed=19, geometry_hash="0123abcd")) == 1
        (query,) = statements
        assert "document" not in query
        (*_, plan), *_ = record._connection.execute(f"EXPLAIN QUERY PLAN {query}").fetchall()
        assert "USING INDEX solves_by_geometry" in plan


def test_a_seed_that_the_file_cannot_hold_is_said(tmp_path):
    with Record(tmp_path / "a.sqlite") as record, pytest.raises(FileError, match="the record cannot hold this"):
        record.append(make_solution(seed=10**30))


def test_a_path_that_is_none_is_said(tmp_path):
    with pytest.raises(FileError, match="the record cannot hold this"):
        Record(f"{tmp_path}/a\0b.sqlite")


def as_another_user(work: Callable[[], str]) -> str:
    """Return what work says in a process that may not write everywhere, as root may."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            if os.getuid() == 0:
                os.setgid(65534)
                os.setuid(65534)
            os.write(writer, work().encode())
        except BaseException as error:
            os.write(writer, f"{type(error).__name__}: {error}".encode())
        os._exit(0)
    os.close(writer)
    os.waitpid(child, 0)
    with os.fdopen(reader) as said:
        return said.read()


def test_a_record_in_a_folder_that_is_read_only_is_listed() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Record(folder / "r.db") as record:
            record.extend([make_solution(), make_solution()])
            record.note_outcome(1, held=True)
        (folder / "r.db").chmod(0o444)
        folder.chmod(0o555)

        def work() -> str:
            with Record(folder / "r.db") as record:
                found = [len(record), len(record.find()), record.outcomes(), record.read(2) == make_solution()]
                with pytest.raises(
                    FileError, match="the record cannot be written: the file or its folder is read only"
                ):
                    record.append(make_solution())
                return str(found)

        assert as_another_user(work) == "[2, 2, [(1, True)], True]"
        assert [p.name for p in folder.iterdir()] == ["r.db"]
        folder.chmod(0o755)


@pytest.mark.parametrize(
    ("statement", "what"),
    [
        ("CREATE TRIGGER t BEFORE INSERT ON solves BEGIN SELECT RAISE(IGNORE); END", "trigger 't'"),
        ("CREATE INDEX i ON outcomes (abs(held))", "index 'i'"),
        ("ALTER TABLE solves ADD COLUMN x AS (1)", "table 'solves'"),
    ],
)
def test_tables_that_only_look_like_ours(statement: str, what: str, tmp_path: Path) -> None:
    with Record(tmp_path / "r.db") as record:
        record.append(make_solution())
    raw = sqlite3.connect(tmp_path / "r.db")
    raw.execute("CREATE TABLE notes (text)")
    raw.commit()
    with Record(tmp_path / "r.db") as record:
        assert len(record) == 1
    raw.execute(statement)
    raw.commit()
    raw.close()
    with pytest.raises(FileError, match=f"it has the {what}, which clench never makes"):
        Record(tmp_path / "r.db")


def test_nobody_else_writes_while_many_are_appended(tmp_path: Path) -> None:
    """The transaction locks the file before the first solution is made, so that the ids are in a row."""
    Record(tmp_path / "r.db").close()
    other = sqlite3.connect(tmp_path / "r.db", timeout=0.0)

    def solutions() -> Iterator[GraspSolution]:
        for _ in range(3):
            with pytest.raises(sqlite3.OperationalError, match="locked"):
                other.execute("DELETE FROM solves")
            yield make_solution()

    with Record(tmp_path / "r.db") as record:
        assert record.extend(solutions()) == [1, 2, 3]
    other.close()


def test_a_record_that_another_process_is_making_is_waited_for(tmp_path: Path) -> None:
    other = sqlite3.connect(tmp_path / "r.db", isolation_level=None, check_same_thread=False)
    other.execute("PRAGMA journal_mode = WAL")
    other.execute("BEGIN IMMEDIATE")
    ends = threading.Timer(0.2, lambda: other.execute("COMMIT"))
    ends.start()
    try:
        with Record(tmp_path / "r.db") as record:
            assert len(record) == 0
    finally:
        ends.join()
        other.close()
