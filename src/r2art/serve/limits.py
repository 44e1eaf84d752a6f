"""What one request may cost."""

from dataclasses import dataclass, fields

import numpy as np

from r2art.core.errors import UsageError
from r2art.core.image import MAX_MEGAPIXELS


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What one request may cost, and how many there may be.

    Attributes:
        megabytes: Largest body, in 10⁶ bytes.
        megapixels: Largest photo or mask, known from its header before any pixel is decoded.
        seconds: From the head of a request to its answer, upload and waiting included.
        workers: Predictions at a time.
        queue: Requests that may wait beside those, uploads in progress included; more are
            refused.

    Raises:
        UsageError: One of them is not positive (a queue may be 0), or allows what
            `r2art.core.image` refuses anyway.
    """

    megabytes: float = 25.0
    megapixels: float = 40.0
    seconds: float = 30.0
    workers: int = 2
    queue: int = 16

    def __post_init__(self) -> None:
        for limit in fields(self):
            value = getattr(self, limit.name)
            least = 0 if limit.name == "queue" else np.nextafter(0, 1)
            if not (np.isfinite(value) and value >= least):
                raise UsageError(f"a limit must be a positive number, got {limit.name}={value:g}")
        if self.megapixels > MAX_MEGAPIXELS:
            raise UsageError(
                f"photos above {MAX_MEGAPIXELS} megapixels are never read, "
                f"got megapixels={self.megapixels:g}; give at most that"
            )

    @property
    def bytes(self) -> int:
        """Largest body in bytes."""
        return int(self.megabytes * 1e6)

    @property
    def places(self) -> int:
        """Requests that may be inside at a time."""
        return self.workers + self.queue
