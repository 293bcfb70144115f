"""Initial weights that keep features at unit size through the encoder.

With torch's defaults every VN-linear shrinks its input, and the global features of an untrained
network are of size 1e-5: below the epsilon of VN-ReLU, and collinear. Scaling each layer once, on
data, starts the training where its gradients carry information.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from vnreg_train.networks.encoder import FeatureExtractor, GlobalModule
from vnreg_train.networks.vn import VNResNetBlock


def _unit_output(layer: nn.Linear, inputs: tuple[Tensor, ...], output: Tensor) -> Tensor:
    """Forward hook: rescales the layer so that its output has r.m.s. 1, and returns that output."""
    factor = output.square().mean().sqrt().clamp(min=1e-12).reciprocal()
    layer.weight.mul_(factor)
    return output * factor


@torch.no_grad()
def scale_initial_weights(extractor: FeatureExtractor, edges: Tensor) -> None:
    """Redraws the encoder's residual branches and scales all its bias-free layers on `edges`.

    edges: (B, N, 3, 3). The last layer of each residual branch, which the authors' code starts at
    zero, starts at random here: a network of shortcuts alone has no use for the clouds' shape,
    since the mean of centred points is zero.
    """
    extractor.eval()
    input_size = edges.square().mean((0, 1, 2)).sqrt()
    hooks = []
    for module in extractor.modules():
        if isinstance(module, GlobalModule):
            # Both are built as layers with weights, which torch types more widely.
            weight: Tensor = module.pre.linear.weight  # type: ignore[union-attr,assignment]
            weight.div_(input_size.repeat(weight.shape[1] // 3))
        if isinstance(module, VNResNetBlock):
            module.fc1.linear.reset_parameters()  # type: ignore[union-attr,operator]
        if isinstance(module, nn.Linear) and "bias" not in dict(module.named_parameters()):
            hooks.append(module.register_forward_hook(_unit_output))
    latent, feature = extractor.global_module(edges)
    extractor.describe(edges, latent, feature)
    for hook in hooks:
        hook.remove()
    extractor.train()
