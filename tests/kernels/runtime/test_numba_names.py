"""The names of Numba and llvmlite that they do not promise to keep: which are used, and where they are."""

from __future__ import annotations

import ast
import importlib
import re
import tomllib
from pathlib import Path

import pytest

from clench.kernels.closing.solve_poses import solve_poses
from clench.kernels.runtime.kernel_cache import index_of

ROOT = Path(__file__).parents[3]
#: The first version that has not been tried. Try it, and read its changes of the names below, before this is raised.
UNTRIED = "0.69"
#: What is imported from modules that the manual of Numba does not describe.
IMPORTED = {
    "llvmlite.binding",
    "llvmlite.ir",
    "numba.core.caching.CompileResultCacheImpl",
    "numba.core.caching.FunctionCache",
    "numba.core.caching.IndexDataCacheFile",
    "numba.core.cgutils",
    "numba.core.codegen.JITCodeLibrary",
    "numba.core.compiler.Compiler",
    "numba.core.compiler.compile_result",
    "numba.core.compiler_lock.global_compiler_lock",
    "numba.core.compiler_machinery.PassManager",
    "numba.core.environment.Environment",
    "numba.core.environment.lookup_environment",
    "numba.core.imputils.impl_ret_borrowed",
    "numba.core.ir",
    "numba.core.registry.CPUDispatcher",
    "numba.core.registry.cpu_target",
    "numba.core.runtime._nrt_python",
    "numba.core.sigutils.normalize_signature",
    "numba.core.typed_passes.NopythonRewrites",
    "numba.core.typing.context.Context",
    "numba.core.typing.templates.AttributeTemplate",
}
#: Attributes of these, of compiled functions, and of what the extension interface passes to functions.
ATTRIBUTES = {
    "llvmlite.binding.ExecutionEngine": {"add_object_file", "finalize_object"},
    "llvmlite.ir.IRBuilder": {"inttoptr", "load"},
    "llvmlite.ir.Type": {"as_pointer"},
    "numba.core.base.BaseContext": {
        *("get_abi_alignment", "get_abi_sizeof", "get_executable", "get_value_type", "insert_user_function"),
    },
    "numba.core.caching.CompileResultCacheImpl": {"check_cachable", "reduce"},
    "numba.core.caching.FunctionCache": {"_guard_against_spurious_io_errors", "_index_key"},
    "numba.core.caching.IndexDataCacheFile": {"_data_name", "_load_index", "_save_data", "load", "save"},
    "numba.core.cgutils": {"alloca_once_value", "gep_inbounds"},
    "numba.core.codegen.JITCPUCodegen": {"_create_empty_module", "magic_tuple", "set_env"},
    "numba.core.codegen.JITCodeLibrary": {
        *("_ensure_finalized", "_finalize_dynamic_globals", "_finalize_final_module", "_get_compiled_object"),
        *("_optimize_functions", "enable_object_caching"),
    },
    "numba.core.codegen.JitEngine": {"_load_defined_symbols", "get_function_address"},
    "numba.core.compiler.CompileResult": {"_find_referenced_environments", "_replace"},
    "numba.core.compiler.Compiler": {"_compile_bytecode", "define_pipelines"},
    "numba.core.compiler.Flags": {"no_compile", "no_cpython_wrapper"},
    "numba.core.compiler_machinery.PassManager": {"_runPass", "finalize"},
    "numba.core.cpu.CPUContext": {"codegen"},
    "numba.core.cpu.CPUTargetOptions": {"_nrt", "no_cfunc_wrapper", "no_cpython_wrapper"},
    "numba.core.datamodel.manager.DataModelManager": {"lookup"},
    "numba.core.environment.Environment": {"_memo", "consts", "globals"},
    "numba.core.ir": {"Assign", "Expr"},
    "numba.core.ir.Block": {"find_insts"},
    "numba.core.pythonapi.PythonAPI": {"decref", "long_as_longlong", "object_getattr_string"},
    "numba.core.registry.CPUDispatcher": {"add_overload", "compile", "get_call_template", "typeof_pyval"},
    "numba.core.registry.cpu_target": {"target_context"},
    "numba.core.runtime._nrt_python": {"c_helpers"},
    "numba.core.typing.context.Context": {"resolve_function_type"},
}
#: Attributes of compiled functions and of their index on disk, which only objects have.
OF_KERNELS = {
    "_analysis",
    "_cache",
    "_cache_file",
    "_cache_hits",
    "_cache_misses",
    "_compiler",
    "_compiling_counter",
    "_data_layout",
    "_ee",
    "_engine",
    "_final_module",
    "_finalized",
    "_load_index",
    "_shared_module",
    "typing_context",
}
SOURCES = [path for folder in ("src", "benchmarks") for path in (ROOT / folder).rglob("*.py")]
FUTURE = "from __future__ import annotations\n"
RUNTIME = sorted((ROOT / "src" / "clench" / "kernels" / "runtime").glob("*.py"))


def undocumented_imports(path: Path) -> set[str]:
    """Return the names that a file imports from where the manual describes nothing."""
    found, text = set[str](), path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text)) if re.search("numba|llvmlite", text) else ():
        if isinstance(node, ast.ImportFrom) and re.match(r"llvmlite\b|numba\.(?!extending$|cuda$)", node.module or ""):
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names = (alias.name for alias in node.names)
            found |= {name for name in names if re.match(r"llvmlite\b|numba\.(?!extending$|cuda$)", name)}
    return found


def find(name: str) -> object:
    """Return a module, or what a module has."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        module, _, rest = name.rpartition(".")
        return getattr(importlib.import_module(module), rest)


def test_every_undocumented_import_is_listed_and_exists() -> None:
    used = set().union(*map(undocumented_imports, SOURCES))
    assert used == IMPORTED
    for name in IMPORTED:
        assert find(name) is not None


def test_undocumented_names_are_used_in_the_runtime_only() -> None:
    others = [path for path in SOURCES if path not in RUNTIME]
    assert len(others) > 400
    assert [path for path in others if undocumented_imports(path)] == []
    private = re.compile(rf"\.({'|'.join(OF_KERNELS)})\b")
    assert [path for path in others if private.search(path.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("owner", ATTRIBUTES)
def test_undocumented_attributes_exist(owner: str) -> None:
    assert {name for name in ATTRIBUTES[owner] if not hasattr(find(owner), name)} == set()


def owner_of(node: ast.Attribute) -> str:
    """Return the last name before an attribute: `pyapi` of `c.pyapi.decref`."""
    return ast.unparse(node.value).rpartition(".")[2]


def test_every_undocumented_attribute_is_listed_and_used() -> None:
    listed = OF_KERNELS.union(*ATTRIBUTES.values())
    text = "".join(path.read_text(encoding="utf-8") for path in RUNTIME)
    assert {name for name in listed if not re.search(rf"\b{name}\b", text)} == set()
    attributes = [node for node in ast.walk(ast.parse(text.replace(FUTURE, ""))) if isinstance(node, ast.Attribute)]
    interface = {"cgutils", "builder", "manager", "context", "pyapi"}
    used = {a.attr for a in attributes if owner_of(a) in interface}
    used |= {a.attr for a in attributes if re.match(r"_[a-z]", a.attr) and owner_of(a) not in ("self", "os")}
    assert len(used) > 15
    assert used <= listed


def test_a_kernel_has_what_its_cache_is_known_by() -> None:
    index = index_of(solve_poses)
    assert callable(index._load_index)
    assert isinstance(index._source_stamp, bytes)


def test_the_versions_that_are_allowed_were_tried() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (numba,) = [each for each in project["dependencies"] if each.startswith("numba>")]
    assert numba.endswith(f",<{UNTRIED}")
