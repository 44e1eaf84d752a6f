"""Shape checks: wherever torch is at hand, every annotation of `r2art.method` is enforced."""

import signal
from importlib.util import find_spec

# A shell's background job ignores Ctrl-C, and so would every process that a test starts.
signal.signal(signal.SIGINT, signal.default_int_handler)

if find_spec("jaxtyping") and find_spec("beartype"):
    from jaxtyping import install_import_hook

    import r2art.method.silhouette_warp  # noqa: F401  (Warp compiles its functions, not Python)

    install_import_hook("r2art.method", "beartype.beartype")
