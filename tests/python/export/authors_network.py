"""A network with the module names and tensor layout of github.com/linchengweiii/CFReg.

Written from its description (docs/paper.md names the facts), so that a state dict of it has the
authors' layout and its outputs say what those weights mean. Vector features are (B, C, 3, N) here.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

EPS = 1e-7


def on_channels(layer: nn.Linear, x: Tensor) -> Tensor:
    return layer(x.transpose(1, -1)).transpose(1, -1)


def half_space(x: Tensor, d: Tensor) -> Tensor:
    dot = (x * d).sum(2, keepdim=True)
    return torch.where(dot >= 0, x, x - dot / ((d * d).sum(2, keepdim=True) + EPS) * d)


class Linear(nn.Module):
    def __init__(self, i: int, o: int) -> None:
        super().__init__()
        self.map_to_feat = nn.Linear(i, o, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        return on_channels(self.map_to_feat, x)


class LeakyReLU(nn.Module):
    def __init__(self, channels: int, shared: bool) -> None:
        super().__init__()
        self.map_to_dir = nn.Linear(channels, 1 if shared else channels, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        return half_space(x, on_channels(self.map_to_dir, x))


class Block(nn.Module):
    def __init__(self, i: int, o: int, shared: bool) -> None:
        super().__init__()
        hidden = min(i, o)
        self.actvn0, self.actvn1 = LeakyReLU(i, shared), LeakyReLU(hidden, shared)
        self.fc0, self.fc1 = Linear(i, hidden), Linear(hidden, o)
        self.shortcut = None if i == o else Linear(i, o)

    def forward(self, x: Tensor) -> Tensor:
        through = x if self.shortcut is None else self.shortcut(x)
        return through + self.fc1(self.actvn1(self.fc0(self.actvn0(x))))


class PointNet(nn.Module):
    def __init__(self, channels: list[int], shared: bool) -> None:
        super().__init__()
        widths = zip(channels[:-1], channels[1:], strict=True)
        self.blocks = nn.ModuleList(Block(2 * i, o, shared) for i, o in widths)

    def forward(self, x: Tensor) -> Tensor:
        for index, block in enumerate(self.blocks):
            x = block(x if index == 0 else with_mean(x))
        return x


def with_mean(x: Tensor) -> Tensor:
    return torch.cat([x, x.mean(3, keepdim=True).expand_as(x)], dim=1)


class GlobalModule(nn.Module):
    def __init__(self, c: int, shared: bool) -> None:
        super().__init__()
        self.fc_pre = Linear(3, 2 * c)
        self.vn_network_0 = PointNet([c] * 4, shared)
        self.vn_network_1 = PointNet([c] * 3, shared)
        self.actvn_global = LeakyReLU(c, shared)
        self.fc_global = Linear(c, c)

    def forward(self, points: Tensor, k: int = 20) -> tuple[Tensor, Tensor]:
        """Centred points (1, 3, N) -> latent beside the global feature (1, 2C, 3, N), global."""
        distance = torch.cdist(points[0].T, points[0].T)
        near = points[0].T[distance.topk(k, largest=False).indices]  # (N, k, 3)
        own = points[0].T.unsqueeze(1).expand_as(near)
        edges = torch.stack([near - own, own, torch.linalg.cross(near, own)])  # (3, N, k, 3)
        feature = self.fc_pre(edges.permute(0, 3, 1, 2).unsqueeze(0)).mean(-1)
        latent = self.vn_network_0(feature)
        pooled = self.vn_network_1(with_mean(latent)).mean(-1)
        feature = self.fc_global(self.actvn_global(pooled))
        expanded = feature.unsqueeze(-1).expand(-1, -1, -1, points.shape[-1])
        return torch.cat([latent, expanded], dim=1), feature


class BatchNorm(nn.Module):
    def __init__(self, channels: int) -> None:
        super().__init__()
        self.bn = nn.BatchNorm1d(channels)

    def forward(self, x: Tensor) -> Tensor:
        norm = x.norm(dim=2) + EPS
        return x / norm.unsqueeze(2) * self.bn(norm).unsqueeze(2)


class LinearLeakyReLU(nn.Module):
    def __init__(self, i: int, o: int, shared: bool) -> None:
        super().__init__()
        self.map_to_feat = nn.Linear(i, o, bias=False)
        self.batchnorm = BatchNorm(o)
        self.map_to_dir = nn.Linear(i, 1 if shared else o, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        projected = self.batchnorm(on_channels(self.map_to_feat, x))
        return half_space(projected, on_channels(self.map_to_dir, x))


class StdFeature(nn.Module):
    def __init__(self, c: int, shared: bool) -> None:
        super().__init__()
        self.vn1 = LinearLeakyReLU(c, c // 2, shared)
        self.vn2 = LinearLeakyReLU(c // 2, c // 4, shared)
        self.vn_lin = nn.Linear(c // 4, 3, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        frame = on_channels(self.vn_lin, self.vn2(self.vn1(x)))
        return torch.einsum("bcan,bkan->bckn", x, frame)


class LocalModule(nn.Module):
    def __init__(self, c: int, n: int, d: int, shared: bool) -> None:
        super().__init__()
        self.vn_network_2 = PointNet([c, n, n], shared)
        self.std_feature = StdFeature(n, shared)
        self.conv_local = nn.Conv1d(3 * n, d, 1, bias=False)
        self.bn_local = nn.BatchNorm1d(d)

    def forward(self, latent: Tensor) -> Tensor:
        invariant = self.std_feature(self.vn_network_2(latent)).flatten(1, 2)
        return torch.relu(self.bn_local(self.conv_local(invariant)))


class ConvNormReLU(nn.Module):
    def __init__(self, i: int, o: int, dimensions: int) -> None:
        super().__init__()
        flat = dimensions == 1
        self.conv = (nn.Conv1d if flat else nn.Conv2d)(i, o, 1, bias=False)
        self.bn = (nn.BatchNorm1d if flat else nn.BatchNorm2d)(o)

    def forward(self, x: Tensor) -> Tensor:
        return torch.relu(self.bn(self.conv(x)))


class ConvBlock(nn.Module):
    def __init__(self, channels: list[int], dimensions: int) -> None:
        super().__init__()
        last = nn.Conv1d if dimensions == 1 else nn.Conv2d
        hidden = zip(channels[:-2], channels[1:-1], strict=True)
        layers: list[nn.Module] = [ConvNormReLU(i, o, dimensions) for i, o in hidden]
        self.conv = nn.ModuleList([*layers, last(channels[-2], channels[-1], 1)])

    def forward(self, x: Tensor) -> Tensor:
        for layer in self.conv:
            x = layer(x)
        return x


class FineRegister(nn.Module):
    def __init__(self, d: int, p: int, s: tuple[int, int]) -> None:
        super().__init__()
        self.sig_fc = ConvBlock([d, *s, 1], 1)
        self.sim_feat_conv = ConvBlock([2 * d + 4, p, p], 2)
        self.sim_mat_conv = ConvBlock([p, p, 1], 2)
        self.weight_fc = ConvBlock([p, p, 1], 1)

    def similarity(self, x: Tensor, y: Tensor, fx: Tensor, fy: Tensor) -> Tensor:
        """Kept points (1, 3, K) and features (1, D, K) -> (1, Ks, Kt)."""
        difference = x.unsqueeze(-1) - y.unsqueeze(-2)
        distance = difference.norm(dim=1, keepdim=True)
        one = fx.unsqueeze(-1).expand(-1, -1, -1, y.shape[-1])
        other = fy.unsqueeze(-2).expand(-1, -1, x.shape[-1], -1)
        pairs = torch.cat([one, other, distance, difference / (distance + 1e-8)], dim=1)
        return self.sim_mat_conv(self.sim_feat_conv(pairs)).squeeze(1).clamp(-20, 20)


class Extractor(nn.Module):
    def __init__(self, c: int, n: int, d: int, shared: bool) -> None:
        super().__init__()
        self.global_module = GlobalModule(c, shared)
        self.local_module = LocalModule(c, n, d, shared)


class AuthorsNetwork(nn.Module):
    def __init__(self, c: int = 8, n: int = 12, d: int = 10, shared: bool = False) -> None:
        super().__init__()
        self.feature_extractor = Extractor(c, n, d, shared)
        self.fine_register = FineRegister(d, 6, (9, 7))
        self.coarse_register = nn.Module()
        self.coarse_register.decoder = nn.Linear(3, 3)  # stands for what training alone needs

    def features(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Centred points (1, 3, N) -> centred global feature (1, C, 3), descriptors (1, D, N)."""
        latent, feature = self.feature_extractor.global_module(points)
        return feature, self.feature_extractor.local_module(latent)


def authors_network(seed: int = 0, shared: bool = False) -> AuthorsNetwork:
    """With random weights and statistics, in evaluation mode."""
    torch.manual_seed(seed)
    network = AuthorsNetwork(shared=shared)
    for module in network.modules():
        if isinstance(module, (nn.Linear, nn.Conv1d, nn.Conv2d)):
            module.weight.data.normal_(0, module.weight[0].numel() ** -0.5)
        if isinstance(module, (nn.BatchNorm1d, nn.BatchNorm2d)):
            assert module.running_mean is not None and module.running_var is not None
            module.running_mean.uniform_(-0.2, 0.2)
            module.running_var.uniform_(0.5, 1.5)
            module.weight.data.uniform_(0.5, 1.5)
            module.bias.data.normal_(0, 0.2)
    return network.eval()
