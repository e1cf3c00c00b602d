"""Parts of kernels: optimised and made machine code inside the kernels that call them, and nowhere else.

numba would do both for each part alone, again in every part above it, and once more in the kernel.
"""

from typing import Any

from numba.core import codegen, compiler, compiler_machinery, typed_passes

# numba declares few types.
_PASS: Any = compiler_machinery.register_pass
_BUILDER: Any = compiler.DefaultPassBuilder


class _PartLibrary(codegen.JITCodeLibrary):
    """Code as it was written, with all that it calls: for a kernel to link in."""

    def _optimize_final_module(self) -> None:
        """Leave that to the kernel."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


@_PASS(mutates_CFG=True, analysis_only=False)
class _PartLowering(typed_passes.NativeLowering):
    """Last stage of the compiler, without machine code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        make: Any = _PartLibrary
        lower: Any = super().run_pass
        state.library = make(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        lower(state)
        # numba finds a part by the built-in function that is its entry; of this one nothing but its identity matters.
        entry = object().__dir__
        state.targetctx.insert_user_function(entry, state["cr"].fndesc, [state.library])
        state["cr"] = state["cr"]._replace(cfunc=entry)
        return True


class PartCompiler(compiler.CompilerBase):
    """numba's own compiler but for its last stage."""

    def define_pipelines(self) -> list[Any]:
        """Stages of the compiler."""
        made, usual = _BUILDER.define_nopython_pipeline(self.state), typed_passes.NativeLowering
        made.passes = [(_PartLowering if each is usual else each, why) for each, why in made.passes]
        made.finalize()
        return [made]
