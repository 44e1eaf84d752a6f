"""Pre-trained weights of timm's models: from its hub, or from files of the user's."""

import urllib.error
import urllib.request
from contextlib import suppress
from pathlib import Path

import timm
from huggingface_hub import constants, hf_hub_download, try_to_load_from_cache

from r2art.core.errors import InputError
from r2art.learn.pretrained import load_trunk
from r2art.method.backbones import Backbone
from r2art.method.paper_network import PaperNet

FILE = "model.safetensors"
PATIENCE = 3.0
"""Seconds to wait for the hub before saying that it cannot be reached."""


def start_backbones(
    network: PaperNet, names: tuple[str, str, str], weights: Path | None, pretrained: bool
) -> None:
    """Load the pre-trained weights of the paper's three backbones, where there are any.

    Args:
        network: Its backbones are overwritten.
        names: Timm names of the frozen one, the depth branch's and the joint branch's.
        weights: A file for the frozen backbone; or a folder with ``NAME.safetensors`` for it and,
            where they are there, for the others, which otherwise start from random numbers.
        pretrained: Whether to ask timm's hub for all three where no weights are given.

    Raises:
        InputError: A file is missing or of another model, or the hub cannot be reached.
    """
    backbones = (network.frozen, network.depth, network.joint)
    if weights is not None:
        paths = _given(weights, names)
    elif pretrained:
        paths = [hub_file(name) for name in names]
    else:
        return
    for backbone, name, path in zip(backbones, names, paths, strict=True):
        if path is not None:
            load_backbone(backbone, name, path)


def load_backbone(backbone: Backbone, name: str, path: Path) -> None:
    """Load a timm file into a backbone of another image size."""
    fresh = Backbone(name, backbone.input_size, fitted=False)
    load_trunk(fresh.body, path)
    fresh.fit()
    backbone.body.load_state_dict(fresh.body.state_dict())


def _given(weights: Path, names: tuple[str, str, str]) -> list[Path | None]:
    if not weights.is_dir():
        return [weights, None, None]
    paths = [weights / f"{name}.safetensors" for name in names]
    return [paths[0], *(p if p.exists() else None for p in paths[1:])]


def hub_file(name: str) -> Path:
    """A model's weights from timm's hub, downloaded once; at once an error without network.

    Raises:
        InputError: They are not on this machine and the hub cannot be reached.
    """
    config = timm.get_pretrained_cfg(name)
    repo = config.hf_hub_id if config else None
    remedy = "connect once to huggingface.co, or give --backbone-weights FILE (.safetensors)"
    if not repo:
        raise InputError(f"timm's hub has no weights of {name}; give --backbone-weights FILE")
    cached = try_to_load_from_cache(repo, FILE)
    if isinstance(cached, str):
        return Path(cached)
    if constants.HF_HUB_OFFLINE:
        raise InputError(f"no weights of {name} here, and HF_HUB_OFFLINE is set; {remedy}")
    try:
        _knock()
        return Path(hf_hub_download(repo, FILE, etag_timeout=PATIENCE))
    except (OSError, urllib.error.URLError) as error:
        raise InputError(
            f"no weights of {name} here, and {constants.ENDPOINT} cannot be reached "
            f"({error}); {remedy}"
        ) from None


def _knock() -> None:
    """Fail within `PATIENCE` where the hub cannot be reached; its client would try for long."""
    request = urllib.request.Request(constants.ENDPOINT, method="HEAD")
    with suppress(urllib.error.HTTPError):  # then it answers
        urllib.request.urlopen(request, timeout=PATIENCE).close()
