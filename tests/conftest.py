"""Shape checks: wherever torch is at hand, every annotation of `r2art.method` is enforced."""

from importlib.util import find_spec

if find_spec("jaxtyping") and find_spec("beartype"):
    from jaxtyping import install_import_hook

    import r2art.method.silhouette_warp  # noqa: F401  (Warp compiles its functions, not Python)

    install_import_hook("r2art.method", "beartype.beartype")
