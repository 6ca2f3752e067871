"""The record: every solve, all its candidates and its choice, in one SQLite file."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import msgspec

from clench.core.exceptions import ClenchError, FileError, UnknownNameError
from clench.core.files.file_limits import JSON_BYTES
from clench.core.files.json_files import check_writable, parse_json
from clench.core.showing.short_repr import described
from clench.solver.documents import solution_from_dict, solution_to_json
from clench.solver.solution import FingerStatus, GraspSolution, SolutionStatus

#: Marks a SQLite file as a record ("clch").
APPLICATION_ID = 0x636C6368
#: Version of the tables below; raised when they change, with a step that carries old files over.
SCHEMA_VERSION = 2

_TABLES = """
CREATE TABLE solves (
    id INTEGER PRIMARY KEY,
    time TEXT NOT NULL,
    hand TEXT NOT NULL,
    object TEXT NOT NULL,
    status TEXT NOT NULL,
    seed INTEGER,
    geometry_hash TEXT NOT NULL,
    touching_fingers INTEGER NOT NULL,
    document BLOB NOT NULL
);
CREATE INDEX solves_by_names ON solves (hand, object, status);
CREATE INDEX solves_by_geometry ON solves (geometry_hash, seed);
"""
#: Version 2 added the outcomes of executions.
_OUTCOMES = """
CREATE TABLE outcomes (
    id INTEGER PRIMARY KEY,
    solve INTEGER NOT NULL REFERENCES solves (id),
    time TEXT NOT NULL,
    held INTEGER NOT NULL
)
"""
_INSERT = """
INSERT INTO solves (time, hand, object, status, seed, geometry_hash, touching_fingers, document)
VALUES (?, ?, ?, ?, ?, ?, ?, ?)
"""
#: The last bytes of a journal that names another file (sqlite.org/fileformat2.html, "The Rollback Journal").
_NAMES_A_FILE = bytes.fromhex("d9d505f920a163d7")
_COLUMNS = ("id", "time", "hand", "object", "status", "seed", "geometry_hash", "touching_fingers")
_Row = tuple[str, str, str, str, int | None, str, int, bytes]


@dataclass(frozen=True)
class RecordEntry:
    """Describe one recorded solve without its document.

    Args:
        id: to read it with. time: when it was appended (UTC, ISO 8601).
        hand, object, status, seed, geometry_hash: as in the solution.
        touching_fingers: how many fingers touch.
    """

    id: int
    time: str
    hand: str
    object: str
    status: SolutionStatus
    seed: int | None
    geometry_hash: str
    touching_fingers: int


class Record:
    """Append solutions to a SQLite file and read them back; a context manager.

    Writes are atomic, and readers in other processes never wait for a writer (write-ahead log). A record in a folder
    that cannot be written can be read.

    Args:
        path: the file; made when missing.

    Raises:
        FileError: the file cannot be opened, is no record, is damaged, or was written by a newer version.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path):
            raise FileError(path, "cannot be opened (no regular file).")
        if not os.path.isdir(self.path.parent):
            raise FileError(path, f"cannot be opened (no folder '{self.path.parent}').")
        _refuse_journal(self.path)
        with self._clear_errors():
            self._is_read_only = not _can_be_written(self.path)
            self._connection = sqlite3.connect(
                _address(self.path) if self._is_read_only else self.path,
                timeout=30.0,
                isolation_level=None,
                uri=self._is_read_only,
            )
            try:
                self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, JSON_BYTES)
                self._prepare()
            except BaseException:
                self._connection.close()
                raise

    def __repr__(self) -> str:
        return described(self, path=self.path)

    @classmethod
    def check(cls, path: str | Path) -> None:
        """Refuse a record that nothing can be appended to, before the work is done; a missing one is not made yet.

        Raises:
            FileError: see `Record`, or it cannot be written.
        """
        check_writable(path)
        if os.path.exists(path):
            with cls(path) as record, record._clear_errors(), record._transaction():
                pass

    def append(self, solution: GraspSolution) -> int:
        """Add one solution and return its id."""
        return self.extend([solution])[0]

    def extend(self, solutions: Iterable[GraspSolution]) -> list[int]:
        """Add many solutions in one transaction, all or none, and return their ids in order.

        Raises:
            ClenchError: a solution has a number that is not finite. FileError: the file cannot be written.
        """
        time = datetime.now(UTC).isoformat(timespec="microseconds")
        with self._clear_errors(), self._transaction() as cursor:
            ids = []
            for solution in solutions:
                cursor.execute(_INSERT, _row(solution, time))
                ids.append(cursor.lastrowid or 0)
            return ids

    def read(self, entry_id: int) -> GraspSolution:
        """Return a recorded solution, equal to the one that was appended.

        Raises:
            UnknownNameError: no such id. FileError: the file is damaged.
        """
        with self._clear_errors():
            row = self._connection.execute("SELECT document FROM solves WHERE id = ?", (entry_id,)).fetchone()
            if row is None:
                known = self._connection.execute("SELECT min(id), max(id) FROM solves").fetchone()
                listed = [] if known[0] is None else [f"{known[0]} to {known[1]}"]
                raise UnknownNameError("solve", str(entry_id), f"record '{self.path}'", listed)
        source = f"{self.path}, solve {entry_id}"
        if not isinstance(row[0], bytes):
            raise FileError(source, "the document is damaged (expected bytes).")
        return solution_from_dict(parse_json(row[0], source), source)

    def find(
        self,
        *,
        hand: str | None = None,
        object: str | None = None,
        status: SolutionStatus | str | None = None,
        geometry_hash: str | None = None,
        seed: int | None = None,
        limit: int | None = None,
    ) -> list[RecordEntry]:
        """Return the entries that match everything given, newest first.

        Raises:
            UnknownNameError: no such status.
        """
        if status is not None and status not in list(SolutionStatus):
            raise UnknownNameError("status", str(status), "solutions", [s.value for s in SolutionStatus])
        requested = {"hand": hand, "object": object, "status": status, "geometry_hash": geometry_hash, "seed": seed}
        given = {column: value for column, value in requested.items() if value is not None}
        condition = " AND ".join(f"{column} = ?" for column in given) or "1"
        query = f"SELECT {', '.join(_COLUMNS)} FROM solves WHERE {condition} ORDER BY id DESC LIMIT ?"
        values = [*(str(v) if isinstance(v, str) else v for v in given.values()), -1 if limit is None else limit]
        with self._clear_errors():
            rows = self._connection.execute(query, values).fetchall()
        return [self._entry(row) for row in rows]

    def note_outcome(self, entry_id: int, *, held: bool) -> None:
        """Record the outcome of executing a solve: the object was held, or dropped.

        Raises:
            UnknownNameError: no such id. FileError: the file cannot be written.
        """
        self.read(entry_id)
        time = datetime.now(UTC).isoformat(timespec="microseconds")
        with self._clear_errors(), self._transaction() as cursor:
            cursor.execute("INSERT INTO outcomes (solve, time, held) VALUES (?, ?, ?)", (entry_id, time, int(held)))

    def outcomes(self) -> list[tuple[int, bool]]:
        """Return the recorded outcomes in order: id of the solve, and whether the object was held."""
        with self._clear_errors():
            if not self._connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'outcomes'").fetchone():
                return []  # version 1, which cannot be carried over where it is read only
            rows = self._connection.execute("SELECT solve, held FROM outcomes ORDER BY id").fetchall()
        return [(int(solve), bool(held)) for solve, held in rows]

    def __len__(self) -> int:
        with self._clear_errors():
            return int(self._connection.execute("SELECT count(*) FROM solves").fetchone()[0])

    def _entry(self, row: tuple[Any, ...]) -> RecordEntry:
        """Return a row of the table as an entry; a damaged file may have anything there."""
        try:
            return msgspec.convert(dict(zip(_COLUMNS, row, strict=True)), RecordEntry)
        except msgspec.ValidationError as error:
            raise FileError(f"{self.path}, solve {row[0]!r}", f"the entry is damaged ({error}).") from None

    def close(self) -> None:
        """Close the file; the record cannot be used any more."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _prepare(self) -> None:
        """Make the tables in a new file; refuse a file that is not ours."""
        c = self._connection
        c.execute("PRAGMA trusted_schema = OFF")
        (identity,) = c.execute("PRAGMA application_id").fetchone()
        (version,) = c.execute("PRAGMA user_version").fetchone()
        (objects,) = c.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if identity == 0 and objects == 0:
            c.execute("PRAGMA journal_mode = WAL")
            with self._transaction() as cursor:
                # Another process may have made the tables since; then there is nothing left to do.
                if cursor.execute("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0:
                    for statement in filter(str.strip, f"{_TABLES}{_OUTCOMES}".split(";")):
                        cursor.execute(statement)
                    cursor.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                    cursor.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        elif identity != APPLICATION_ID:
            raise FileError(self.path, "a SQLite file of another program, not a record of solves.")
        elif version > SCHEMA_VERSION:
            raise FileError(self.path, f"a record of version {version}; this program reads up to {SCHEMA_VERSION}.")
        self._check_tables()
        if self._is_read_only:
            return
        c.execute("PRAGMA journal_mode = WAL")
        c.execute("PRAGMA synchronous = NORMAL")
        if identity == APPLICATION_ID and version < SCHEMA_VERSION:
            with self._transaction() as cursor:
                # Another process may have carried the file over since.
                if cursor.execute("PRAGMA user_version").fetchone()[0] < SCHEMA_VERSION:
                    cursor.execute(_OUTCOMES)
                    cursor.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def _check_tables(self) -> None:
        """Refuse tables that only look like ours: views, triggers and computed columns run code of their author.

        Other tables in the file are left alone; nothing reads them.
        """
        ours = {" ".join(s.split()) for s in f"{_TABLES}{_OUTCOMES}".split(";")}
        query = "SELECT type, name, sql FROM sqlite_master WHERE lower(name) IN (?, ?) OR lower(tbl_name) IN (?, ?)"
        for kind, name, sql in self._connection.execute(query, ("solves", "outcomes") * 2):
            if " ".join(str(sql).split()) not in ours:
                raise FileError(
                    self.path, f"no record of clench's: it has the {kind} '{name}', which clench never makes."
                )

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Cursor]:
        cursor = self._connection.cursor()
        cursor.execute("BEGIN IMMEDIATE")
        try:
            yield cursor
            cursor.execute("COMMIT")
        except BaseException:
            if self._connection.in_transaction:
                cursor.execute("ROLLBACK")
            raise

    @contextmanager
    def _clear_errors(self) -> Iterator[None]:
        """Turn the database's errors into one sentence that names the file."""
        try:
            yield
        except ClenchError:
            raise
        except (OverflowError, ValueError) as error:
            raise FileError(self.path, f"the record cannot hold this ({error}).") from None
        except sqlite3.DatabaseError as error:
            text = str(error)
            if "not a database" in text:
                problem = "not a record of solves: the file is no SQLite database."
            elif "malformed" in text or "corrupt" in text or "disk image" in text:
                problem = "the record is damaged and cannot be read."
            elif "readonly" in text:
                problem = "the record cannot be written: the file or its folder is read only."
            elif "closed" in text:
                problem = "the record is closed."
            else:
                problem = f"the record cannot be used ({text})."
            raise FileError(self.path, problem) from None


def _can_be_written(path: Path) -> bool:
    """Return whether SQLite can write a file and its log beside it; a file that is missing is made."""
    return os.access(path.parent, os.W_OK) and (not os.path.exists(path) or os.access(path, os.W_OK))


def _refuse_journal(path: Path) -> None:
    """Refuse a journal that names another file, which SQLite would read, and may delete.

    SQLite writes such a name only where several databases are written together; clench never does that.

    Raises:
        FileError: with the journal.
    """
    journal = Path(f"{path}-journal")
    try:
        with open(journal, "rb") as file:
            file.seek(-len(_NAMES_A_FILE), os.SEEK_END)
            found = file.read() == _NAMES_A_FILE
    except (OSError, ValueError):
        return  # none, or one that is too short for a name
    if found:
        raise FileError(journal, "a journal that names another file, which clench never leaves; remove it.")


def _address(path: Path) -> str:
    """Return the address under which SQLite only reads a file; without a log beside it, it takes no lock either."""
    still = "" if os.path.exists(f"{path}-wal") else "&immutable=1"
    return f"{path.absolute().as_uri()}?mode=ro{still}"


def _row(solution: GraspSolution, time: str) -> _Row:
    touching = sum(f.status is FingerStatus.TOUCH for f in solution.fingers.values())
    return (
        time,
        solution.hand,
        solution.object,
        solution.status.value,
        solution.seed,
        solution.geometry_hash,
        touching,
        solution_to_json(solution),
    )
