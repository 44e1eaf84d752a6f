"""Random tensors from one seeded generator."""

import torch
from torch import Tensor


class Chance:
    """Random tensors; but for `grain`, the same seed gives the same ones on every device."""

    def __init__(self, seed: int, device: torch.device) -> None:
        self.generator = torch.Generator().manual_seed(seed)
        self.device = device
        on_cpu = device.type == "cpu"
        self._grain = self.generator if on_cpu else torch.Generator(device).manual_seed(seed)

    def uniform(self, low: float, high: float, *shape: int) -> Tensor:
        """Uniform numbers in [low, high)."""
        return low + (high - low) * torch.rand(shape, generator=self.generator).to(self.device)

    def normal(self, *shape: int) -> Tensor:
        """Standard normal numbers."""
        return torch.randn(shape, generator=self.generator).to(self.device)

    def grain(self, *shape: int) -> Tensor:
        """Standard normal numbers, one per pixel: so many that the device itself makes them."""
        return torch.randn(shape, generator=self._grain, device=self.device)

    def happens(self, probability: float, *shape: int) -> Tensor:
        """Independent events."""
        return (torch.rand(shape, generator=self.generator) < probability).to(self.device)

    def choice(self, n: int, k: int) -> Tensor:
        """``k`` indices below ``n``, with repetition."""
        return torch.randint(n, (k,), generator=self.generator)
