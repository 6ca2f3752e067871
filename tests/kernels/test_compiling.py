"""What is compiled is kept on disk for as long as nothing that went into it has changed."""

import importlib.util
import shutil
import sys
from pathlib import Path

from clench.kernels import compiling, warming


def test_every_kernel_is_kept_by_the_source_of_all_kernels():
    stamps = {compiling.index_of(kernel)._source_stamp for kernel in (*warming.HERE, *warming.THERE)}
    assert stamps == {compiling.source_stamp()}


def test_a_change_of_any_kernel_changes_the_stamp(tmp_path, monkeypatch):
    copy = shutil.copy(compiling.__file__, tmp_path)
    spec = importlib.util.spec_from_file_location("clench.kernels.copied", copy)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)

    def stamp() -> bytes:
        module.source_stamp.cache_clear()
        return module.source_stamp()

    called = Path(tmp_path, "called.py")
    called.write_text("STEPS = 8\n")
    before = stamp()
    called.write_text("STEPS = 9\n")
    changed = stamp()
    called.write_text("STEPS = 8\n")
    assert changed != before == stamp()
    monkeypatch.setattr(module.tolerances, "__file__", str(called))
    assert stamp() != before  # the numbers that are compiled in count as well
