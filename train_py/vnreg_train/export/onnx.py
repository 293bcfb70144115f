"""Both networks as ONNX files, for other runtimes: what mode verified and mode paper call "encode".

    python -m vnreg_train.export.onnx models/vnreg.vnr vnreg.onnx --points 1024

Inputs and outputs are plain arrays, both clouds in one batch (source first), names as in
docs/design.md. What is not in the graph is what no tensor runtime does well, and what the engine
does outside of its stage "encode" too: the k nearest neighbours, and the registers that make poses
of the features. Shapes are fixed at export: runtimes plan their memory by them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from torch import Tensor, nn

from vnreg_train.export.descriptor_model import import_descriptor_model
from vnreg_train.export.import_model import import_model
from vnreg_train.model_file import read_model
from vnreg_train.networks.descriptor import DescriptorNetwork, input_features
from vnreg_train.networks.registration import RegistrationNetwork

CLOUDS = 2
OPSET = 18


class PaperEncoder(nn.Module):
    """Edge vectors (B, N, 3, 3) -> global (B, 3, C), descriptor (B, N, D), significance (B, N)."""

    input_names = ("edge",)
    output_names = ("global", "descriptor", "significance")

    def __init__(self, network: RegistrationNetwork) -> None:
        super().__init__()
        self.extractor = network.extractor
        self.significance = network.fine.significance

    def forward(self, edges: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        latent, feature = self.extractor.global_module(edges)
        descriptors = self.extractor.describe(edges, latent, feature)
        return feature, descriptors, self.significance(descriptors).squeeze(-1)

    def example(self, points: int) -> tuple[Tensor, ...]:
        return (torch.randn(CLOUDS, points, 3, 3),)


class DescriptorEncoder(nn.Module):
    """Points (B, N, 3) in network coordinates, the encoded ones first -> Features of those."""

    input_names = ("points",)
    output_names = (
        "descriptor.local",
        "descriptor.context",
        "significance",
        "overlap",
        "frames.local",
        "frames.context",
        "global",
    )

    def __init__(self, network: DescriptorNetwork, encoded: int) -> None:
        super().__init__()
        self.network, self.encoded = network, encoded

    def forward(self, points: Tensor) -> tuple[Tensor, ...]:
        mask = torch.ones_like(points[..., 0])
        inputs = input_features(points, mask, self.encoded, self.network.config.moment_radii)
        return tuple(self.network(points[:, : self.encoded], inputs))

    def example(self, points: int) -> tuple[Tensor, ...]:
        return (torch.randn(CLOUDS, points, 3),)


Encoder = PaperEncoder | DescriptorEncoder


def load_encoder(model: str | Path, points: int) -> Encoder:
    """The encoder of a model file, in evaluation mode, for clouds of so many points.

    Raises ModelFileError for a broken file.
    """
    metadata, _ = read_model(model)
    if metadata["arch"] == "paper":
        return PaperEncoder(import_model(model)[0]).eval()
    network, _ = import_descriptor_model(model)
    encoded = metadata["input.encoded"]
    assert isinstance(encoded, int)
    return DescriptorEncoder(network, min(points, encoded)).eval()


def export_onnx(encoder: Encoder, path: Path, points: int) -> None:
    """Writes the encoder for a pair of clouds of `points` points each."""
    program = torch.onnx.export(
        encoder,
        encoder.example(points),
        input_names=list(encoder.input_names),
        output_names=list(encoder.output_names),
        opset_version=OPSET,
        dynamo=True,
        verbose=False,
    )
    assert program is not None
    program.save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description="write a model file's encoder as ONNX")
    parser.add_argument("model", type=Path, help="a .vnr file of either architecture")
    parser.add_argument("out", type=Path)
    parser.add_argument("--points", type=int, default=1024, help="per cloud (default 1024)")
    arguments = parser.parse_args()
    export_onnx(load_encoder(arguments.model, arguments.points), arguments.out, arguments.points)


if __name__ == "__main__":
    main()
