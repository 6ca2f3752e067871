"""The shape of the software: layers, sizes and imports, read from the source."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

import branch_coverage
import clench
from clench.kernels.runtime.warming import warm_up

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "clench"
BENCHMARKS = ROOT / "benchmarks"
TESTS = ROOT / "tests"
#: Tests that are not of one part of the package: oracles, other programs, malformed files, mistakes put in.
OTHER_TESTS = {"benchmarks", "engine", "fuzz", "graspit", "hostile", "mutation", "oracle"}
LAYERS = ["core", "kernels", "models", "mechanics", "closing", "scoring", "solver", "execution", "planner", "dataset"]
LAYERS += ["apps"]
#: Files that list public names by the modules that define them: imports in them are for type checkers alone.
NAMESPACES = {PACKAGE / name for name in ("criteria.py", "errors.py", "formats.py", "types.py")}
NAMESPACES |= {PACKAGE / name / "__init__.py" for name in ("mechanics", "execution")}
HEAVY = {"numba", "mujoco", "matplotlib", "trimesh", "coacd", "clarabel", "tyro", "rich", "PIL", "rclpy", "viser"}
HEAVY |= {"pyarrow", "h5py", "ray", "torch", "IPython", "pxr"}
VAGUE = {"utils", "util", "helpers", "helper", "common", "misc"}
FILES = sorted(PACKAGE.rglob("*.py"))
#: The package and the benchmarks.
SOURCES = [*FILES, *sorted(BENCHMARKS.rglob("*.py"))]
KERNEL_FILES = [path for path in SOURCES if "kernels" in path.relative_to(ROOT).parent.parts]
MAX_FILE_LINES = 400
MAX_BODY_LINES = 60
#: Of one folder, `__init__.py` among them.
MAX_FOLDER_FILES = 16
#: Folders that are still larger.
LARGE_FOLDERS = {PACKAGE / "kernels" / name for name in ("closing", "sections", "toi")}


def shown(path: Path) -> str:
    """Return a path as messages name it: from the root of the project."""
    return str(path.relative_to(ROOT))


def expect_none(wrong: Iterable[str]) -> None:
    """Fail with every finding, one per line. Each finding names its file."""
    found = list(wrong)
    assert not found, "\n" + "\n".join(found)


def findings(check: Callable[[str, Path], list[str]], paths: Iterable[Path] = FILES) -> list[str]:
    """Return what a check finds in all files; a check takes the source and the path of one file."""
    paths = list(paths)
    assert len(paths) > 50, "the files of the package were not found"
    return [finding for path in paths for finding in check(path.read_text(encoding="utf-8"), path)]


def module_name(path: Path) -> str:
    root = PACKAGE.parent if path.is_relative_to(PACKAGE) else ROOT
    parts = list(path.relative_to(root).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_modules(tree: ast.AST, path: Path) -> Iterator[tuple[int, str, tuple[str, ...]]]:
    """Give line, absolute module and names of every import, wherever it stands."""
    package = module_name(path).split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name, ()
        elif isinstance(node, ast.ImportFrom):
            names = tuple(alias.name for alias in node.names)
            above = package[: len(package) - node.level + 1] if node.level else []
            yield node.lineno, ".".join([*above, *([node.module] if node.module else [])]), names


def upward_imports(source: str, path: Path) -> list[str]:
    """Name the imports that do not point to the same layer or one below."""
    parts = module_name(path).split(".")
    if len(parts) < 2 or path in NAMESPACES:
        return []
    if parts[1] not in LAYERS:
        return [f"{shown(path)} is in no layer"]
    own = LAYERS.index(parts[1])
    wrong = []
    for line, module, names in imported_modules(ast.parse(source), path):
        if module.split(".")[0] != "clench":
            continue
        if module == "clench" and parts[1] == "apps":
            continue  # what people touch uses the public names, as people do
        if module == "clench":
            targets = [n for n in names if n != "__version__"] or ([] if names else ["clench itself"])
        else:
            targets = [module.split(".")[1]]
        wrong += [f"{shown(path)}:{line} imports {t}" for t in targets if t not in LAYERS or LAYERS.index(t) > own]
    return wrong


def module_level_imports(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Give imports that run when the module is loaded: not in functions, not for type checkers only."""
    pending: list[ast.stmt] = list(tree.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.lineno, ("." * node.level) + (node.module or "")
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            pending += node.orelse
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            pending += [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt)]


def heavy_imports(source: str, path: Path) -> list[str]:
    in_kernels = "kernels" in path.relative_to(ROOT).parent.parts
    allowed = {"numba"} if in_kernels else set()
    wrong = []
    for line, module in module_level_imports(ast.parse(source)):
        root = module.split(".")[0]
        if (root in HEAVY and root not in allowed) or (module.startswith("clench.kernels") and not in_kernels):
            wrong.append(f"{shown(path)}:{line} imports {module}")
    return wrong


def long_bodies(source: str, path: Path) -> list[str]:
    wrong = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        body = node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body
        lines = body[-1].end_lineno - body[0].lineno + 1 if body else 0
        if lines > MAX_BODY_LINES:
            wrong.append(f"{shown(path)}:{node.lineno} the body of {node.name} has {lines} lines")
    return wrong


def long_files(source: str, path: Path) -> list[str]:
    lines = len(source.splitlines())
    return [f"{shown(path)} has {lines} lines"] if lines > MAX_FILE_LINES else []


def vague_names(_source: str, path: Path) -> list[str]:
    return [f"{shown(path)} has the vague name {name}" for name in sorted(VAGUE & set(module_name(path).split(".")))]


def test_imports_point_down() -> None:
    expect_none(findings(upward_imports))


def test_heavy_packages_are_imported_where_used() -> None:
    expect_none(findings(heavy_imports, SOURCES))


def test_files_are_short() -> None:
    expect_none(findings(long_files, SOURCES))


def test_function_bodies_are_short() -> None:
    expect_none(findings(long_bodies, SOURCES))


def test_names_say_something() -> None:
    expect_none(findings(vague_names, SOURCES))


def imports_of_benchmarks(source: str, path: Path) -> list[str]:
    found = imported_modules(ast.parse(source), path)
    return [f"{shown(path)}:{line} imports {m}" for line, m, _ in found if m.split(".")[0] == BENCHMARKS.name]


def test_the_package_does_not_import_the_benchmarks() -> None:
    expect_none(findings(imports_of_benchmarks))
    assert imports_of_benchmarks("from benchmarks.speed import solving", FILES[0])


def names_twice(paths: Iterable[Path], among: Iterable[Path]) -> list[str]:
    """Name the files whose name another file has, too."""
    count = Counter(path.name for path in among)
    return [f"{shown(p)}: {count[p.name]} files have this name" for p in paths if count[p.name] > 1]


def large_folders(paths: Iterable[Path]) -> dict[Path, str]:
    """Name the folders that have too many files."""
    files = Counter(path.parent for path in paths)
    return {path: f"{shown(path)} has {n} files" for path, n in files.items() if n > MAX_FOLDER_FILES}


def test_no_two_files_share_a_name() -> None:
    modules = [path for path in SOURCES if path.name != "__init__.py"]
    assert len(modules) > 400
    expect_none(names_twice(modules, modules))
    # Programs of the benchmarks are also started by name, where tests and examples can be imported.
    others = [*(ROOT / "tests").rglob("*.py"), *(ROOT / "examples").rglob("*.py")]
    mine = [path for path in modules if path.is_relative_to(BENCHMARKS)]
    assert len(mine) > 20
    expect_none(names_twice(mine, [*mine, *others]))


def test_folders_are_small() -> None:
    large = large_folders(SOURCES)
    expect_none(finding for folder, finding in large.items() if folder not in LARGE_FOLDERS)
    expect_none(f"{shown(folder)} is small now, and no exception" for folder in LARGE_FOLDERS - set(large))


def test_every_folder_is_a_layer() -> None:
    folders = {p for p in PACKAGE.iterdir() if any(p.glob("**/*.py"))}
    expect_none(f"{shown(p)} is not a layer" for p in sorted(folders) if p.name not in LAYERS)
    modules = set(PACKAGE.glob("*.py"))
    assert PACKAGE / "__init__.py" in modules
    expect_none(f"{shown(p)} is in no layer" for p in sorted(modules - {PACKAGE / "__init__.py"} - NAMESPACES))


@pytest.mark.parametrize(
    "statement",
    [
        "from clench.solver import solution",
        "def f():\n    from clench.solver.solution import GraspSolution",
        "from ..solver.solution import GraspSolution",
        "import clench.apps.cli.main",
        "import clench",
        "from clench import solve",
        "from .. import solve",
    ],
)
def test_the_layer_check_sees_an_upward_import(statement: str) -> None:
    assert upward_imports(statement, PACKAGE / "closing" / "x.py") != []


@pytest.mark.parametrize(
    "statement",
    [
        "from clench.core.pose import Pose",
        "from ..models.mesh import TriangleMesh",
        "from .planes import x",
        "from clench import __version__",
        "import numpy",
    ],
)
def test_the_layer_check_lets_downward_imports_pass(statement: str) -> None:
    assert upward_imports(statement, PACKAGE / "closing" / "x.py") == []


def test_the_other_checks_see_what_they_look_for() -> None:
    path = PACKAGE / "closing" / "x.py"
    assert heavy_imports("import numba", path)
    assert heavy_imports("if True:\n    import mujoco.viewer", path)
    assert heavy_imports("class A:\n    from matplotlib import pyplot", path)
    assert heavy_imports("from clench.kernels.contact import first", path)
    assert not heavy_imports("import numba", PACKAGE / "kernels" / "x.py")
    assert not heavy_imports("def f():\n    import mujoco", path)
    assert not heavy_imports("if TYPE_CHECKING:\n    import mujoco", path)
    long = "def f():\n    '''Doc.'''\n" + "    x = 1\n" * MAX_BODY_LINES
    assert not long_bodies(long, path)
    assert long_bodies(long + "    x = 1\n", path)
    assert not long_files("x = 1\n" * MAX_FILE_LINES, path)
    assert long_files("x = 1\n" * (MAX_FILE_LINES + 1), path)
    assert not vague_names("", path)
    assert vague_names("", PACKAGE / "grasp" / "utils.py")
    assert vague_names("", PACKAGE / "common" / "x.py")
    assert names_twice([path], [path, PACKAGE / "core" / "x.py"])
    assert not names_twice([path], [path])
    assert large_folders([path] * (MAX_FOLDER_FILES + 1))
    assert not large_folders([path] * MAX_FOLDER_FILES)


#: Compiled without counts of references.
PLAIN_KERNELS = {"kernel", "entry_kernel"}


Kernel = tuple[Path, ast.FunctionDef]


def kernels(*decorators: str) -> dict[str, Kernel]:
    """Return file and definition of the kernels with one of some decorators, by name."""
    return {
        node.name: (path, node)
        for path in KERNEL_FILES
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and {ast.unparse(d) for d in node.decorator_list} & set(decorators)
    }


def test_kernels_that_count_no_references_hand_out_no_arrays() -> None:
    # What they hand out would be freed once too often, and what they are handed would never be freed.
    numbers = {
        "None",
        "bool",
        "int",
        "float",
        "tuple",
        "Point",
        "Vector",
        "Flat",
        "Triple",
        "Deepest",
        "Separation",
        "Outline",
    }
    plain, counting = kernels(*PLAIN_KERNELS), kernels("kernel(allocates=True)", "entry_kernel(allocates=True)")
    assert len(plain) > 100

    def with_arrays(functions: dict[str, Kernel]) -> set[str]:
        returned = {name: ast.unparse(node.returns or ast.Constant(None)) for name, (_, node) in functions.items()}
        return {name for name, text in returned.items() if not set(re.findall(r"\w+", text)) <= numbers}

    # One that takes rows of what it is handed is for those alone that do not count either.
    rows, arrays = with_arrays(plain), with_arrays(counting)
    assert "mesh_of" in rows
    assert "make_work" in arrays
    inner = kernels("kernel")
    wrong = [f"{shown(plain[name][0])}: {name} returns arrays, and Python can call it" for name in rows - set(inner)]
    for functions, barred in ((plain, arrays), (counting, rows)):
        for name, (path, node) in functions.items():
            called = {c.func.id for c in ast.walk(node) if isinstance(c, ast.Call) and isinstance(c.func, ast.Name)}
            wrong += [f"{shown(path)}: {name} calls {other}" for other in sorted(called & barred)]
    expect_none(wrong)


def test_no_two_test_files_have_one_name() -> None:
    # Test folders are not packages, so pytest collects only one of two modules of the same name.
    paths = sorted(TESTS.rglob("test_*.py"))
    count = Counter(path.name for path in paths)
    expect_none(
        f"{shown(path)} has a name that occurs {count[path.name]} times" for path in paths if count[path.name] > 1
    )


def mirrored(module: Path) -> list[Path]:
    """Return where a test file of a module may be: in the folder of the same name, or above it."""
    folder = module.relative_to(PACKAGE).parent
    return [TESTS / each / f"test_{module.stem}.py" for each in (folder, *folder.parents)]


def test_every_module_has_a_test_file_of_its_name_or_another_one_that_is_named() -> None:
    table = tomllib.loads((TESTS / "tested_by.toml").read_text(encoding="utf-8"))
    expect_none(f"tests/{name} does not exist" for name in table if not (TESTS / name).is_file())
    listed = Counter(module for modules in table.values() for module in modules)
    modules = {path.relative_to(PACKAGE).with_suffix("").as_posix(): path for path in FILES if path.stem != "__init__"}
    own = {name for name, path in modules.items() if any(test.is_file() for test in mirrored(path))}
    assert len(own) > 180
    expect_none(
        f"{name} has no test file, and is not in tests/tested_by.toml" for name in set(modules) - own - set(listed)
    )
    expect_none(f"tests/tested_by.toml: {name} has a test file" for name in own & set(listed))
    expect_none(f"tests/tested_by.toml: there is no module {name}" for name in set(listed) - set(modules))
    expect_none(f"tests/tested_by.toml: {name} is listed {n} times" for name, n in listed.items() if n > 1)


def test_folders_of_tests_are_folders_of_the_package() -> None:
    folders = {path.parent.relative_to(TESTS) for path in TESTS.rglob("test_*.py")}
    assert len(folders) > 20
    expect_none(
        f"tests/{folder} has no folder in the package"
        for folder in folders
        if folder.parts and folder.parts[0] not in OTHER_TESTS and not (PACKAGE / folder).is_dir()
    )


def test_measured_branches_are_of_packages_and_tests_that_exist() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["tool"]["coverage"]["run"]["source"] == [f"src/clench/{name}" for name in branch_coverage.PACKAGES]
    expect_none(f"{name} is no layer" for name in branch_coverage.PACKAGES if name not in LAYERS)
    named = {*branch_coverage.BRIEF, *branch_coverage.WHOLE, *branch_coverage.STEP_TESTS}
    expect_none(f"tests/{name} does not exist" for name in named if not (TESTS / name).exists())


def test_python_never_imports_a_kernel_without_an_entry() -> None:
    # A call of such a kernel from Python raises.
    inner = set(kernels("kernel", "kernel(allocates=True)"))
    assert "close_dof" in inner
    callers = [path for path in SOURCES if path not in KERNEL_FILES]
    wrong = []
    for path in [*callers, *TESTS.rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and re.match(
                r"(clench|benchmarks)\.(.*\.)?kernels\b", node.module or ""
            ):
                names = sorted(inner & {alias.name for alias in node.names})
                wrong += [f"{shown(path)}:{node.lineno} imports {name}" for name in names]
    expect_none(wrong)


#: What makes an array; a kernel without counts of references cannot, and says so only when its cache is empty.
MAKERS = {"zeros", "empty", "ones", "full", "eye", "arange", "array", "zeros_like", "empty_like", "copy", "astype"}


def makers_of_arrays(source: str) -> list[str]:
    """Return the kernels that may not allocate, and do."""
    found = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef) and {ast.unparse(d) for d in node.decorator_list} & PLAIN_KERNELS:
            calls = [
                c.func.attr for c in ast.walk(node) if isinstance(c, ast.Call) and isinstance(c.func, ast.Attribute)
            ]
            found += [node.name] if MAKERS & set(calls) else []
    return found


def test_kernels_that_allocate_are_marked() -> None:
    expect_none(
        findings(lambda source, path: [f"{shown(path)}: {n} allocates" for n in makers_of_arrays(source)], KERNEL_FILES)
    )


def test_a_kernel_that_allocates_unmarked_is_found() -> None:
    assert makers_of_arrays("@kernel\ndef f(a):\n    return np.zeros(3)\n") == ["f"]
    assert not makers_of_arrays("@kernel(allocates=True)\ndef f(a):\n    return np.zeros(3)\n")


def test_import_loads_four_modules_and_no_other_package() -> None:
    # Names of the root load their modules when they are first used. So the import takes a hundredth of a second.
    program = (
        "import sys; before = set(sys.modules); import clench; new = set(sys.modules) - before; "
        "packages = {name.partition('.')[0] for name in new} - set(sys.stdlib_module_names); "
        "print(sorted(packages), len([name for name in new if name.startswith('clench.')]))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "['clench'] 4"


def test_a_solve_loads_only_what_it_needs() -> None:
    # Convex pieces, cone programs, mesh files, pictures and tables have packages of their own, which take their time.
    program = (
        "import sys, clench as c; solve = c.solve; before = sorted({'numba', 'mujoco'} & set(sys.modules)); "
        "solve(c.Hand.load('robonaut2'), c.GraspObject.load('mug'), c.Pose([0, 0, 0.1])); "
        "heavy = {'matplotlib', 'coacd', 'clarabel', 'trimesh', 'rich', 'tyro', 'PIL'}; "
        "print(before, sorted(heavy & set(sys.modules)))"
    )
    warm_up()  # Only what compiles shows a bar, which loads rich.
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[] []"


def test_the_types_load_without_heavy_packages() -> None:
    program = (
        "import sys, clench as c; c.Hand, c.GraspObject, c.GraspCommand, c.GraspSolution, c.Record; "
        f"print(sorted({HEAVY!r} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_the_version_is_written_once() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in project["project"]
    assert "version" in project["project"]["dynamic"]
    assert project["tool"]["hatch"]["version"] == {"path": "src/clench/__init__.py"}
    assert importlib.metadata.version("clench") == clench.__version__
