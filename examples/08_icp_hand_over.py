"""Scans of many points: vnreg finds the pose from a thousand of them, ICP on all points refines it.

Needs small_gicp; --with open3d uses Open3D instead.
"""

import argparse
import importlib.util
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vnreg

Array = NDArray[np.float64]


def small_gicp_refined(source: Array, target: Array, T_target_source: Array) -> Array:
    """The pose after generalised ICP, (4, 4)."""
    import small_gicp

    result = small_gicp.align(
        target,
        source,
        init_T_target_source=T_target_source,
        registration_type="GICP",
        downsampling_resolution=0.001,
        max_correspondence_distance=0.005,
    )
    return np.asarray(result.T_target_source)


def open3d_refined(source: Array, target: Array, T_target_source: Array) -> Array:
    """The pose after point-to-plane ICP, (4, 4)."""
    import open3d as o3d

    clouds = []
    for points in (source, target):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
        clouds.append(cloud)
    result = o3d.pipelines.registration.registration_icp(
        *clouds,
        max_correspondence_distance=0.005,
        init=T_target_source,
        estimation_method=o3d.pipelines.registration.TransformationEstimationPointToPlane(),
    )
    return np.asarray(result.transformation)


def large_scans() -> tuple[Array, Array, Array]:
    """Two scans of the mug with 30,000 points and 0.1 mm of noise, and the pose between them."""
    path = Path(__file__).parent / "data" / "make_mug.py"
    spec = importlib.util.spec_from_file_location("make_mug", path)
    assert spec is not None and spec.loader is not None
    make_mug = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make_mug)
    rng = np.random.default_rng(5)
    T = make_mug.T_MUG_2_MUG_1
    source = make_mug.mug(rng, 30_000) + 0.0001 * rng.normal(size=(30_000, 3))
    target = make_mug.mug(rng, 30_000) @ T[:3, :3].T + T[:3, 3]
    return source, target + 0.0001 * rng.normal(size=target.shape), T


def error(pose: Array, truth: Array) -> str:
    """Rotation and translation, the latter of the scan's centre."""
    missing = np.linalg.inv(truth) @ pose
    angle = np.degrees(np.arccos(np.clip((np.trace(missing[:3, :3]) - 1) / 2, -1, 1)))
    return f"{angle:.3f} degrees, {1000 * np.linalg.norm(missing[:3, 3]):.3f} mm"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--with", dest="library", choices=["small_gicp", "open3d"])
    library = parser.parse_args().library or "small_gicp"
    source, target, truth = large_scans()

    result = vnreg.align(source, target)
    if not result.has_pose:
        raise SystemExit(f"no pose: {result.status}")
    refine = small_gicp_refined if library == "small_gicp" else open3d_refined
    refined = refine(source, target, result.T_target_source)

    print(f"vnreg, {result.points_source} points: off by {error(result.T_target_source, truth)}")
    print(f"{library}, {len(source)} points: off by {error(refined, truth)}")


if __name__ == "__main__":
    main()
