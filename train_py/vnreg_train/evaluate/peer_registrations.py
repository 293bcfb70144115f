"""How each peer is called: functions from two clouds and its settings to a pose.

source (N, 3), target (M, 3) float64 -> T_target_source (4, 4), or None where the peer gives none.
Lengths are in the clouds' unit. Every call is deterministic, on one thread.
"""

from __future__ import annotations

import kiss_matcher
import numpy as np
import open3d as o3d
import small_gicp

from vnreg_train.data.mesh import Float64

SEED = 0
NORMAL_NEIGHBOURS, FEATURE_NEIGHBOURS = 30, 100  # Open3D's own examples
CENTRED = "centroids"


def open3d_ransac(
    source: Float64,
    target: Float64,
    *,
    normal_radius: float,
    feature_radius: float,
    inlier_distance: float,
    mutual_filter: bool,
    icp_distance: float,
) -> Float64 | None:
    """FPFH, RANSAC on three matches with Open3D's checks of edge length and distance; ICP."""
    registration = o3d.pipelines.registration
    o3d.utility.random.seed(SEED)
    clouds = _cloud(source, normal_radius), _cloud(target, normal_radius)
    features = [_fpfh(cloud, feature_radius) for cloud in clouds]
    result = registration.registration_ransac_based_on_feature_matching(
        *clouds,
        *features,
        mutual_filter,
        inlier_distance,
        registration.TransformationEstimationPointToPoint(False),
        3,
        [
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(inlier_distance),
        ],
        registration.RANSACConvergenceCriteria(100_000, 0.999),
    )
    return _icp(*clouds, np.asarray(result.transformation), icp_distance)


def open3d_fgr(
    source: Float64,
    target: Float64,
    *,
    normal_radius: float,
    feature_radius: float,
    inlier_distance: float,
    tuple_test: bool,
    icp_distance: float,
) -> Float64 | None:
    """FPFH, fast global registration, ICP."""
    registration = o3d.pipelines.registration
    o3d.utility.random.seed(SEED)
    clouds = _cloud(source, normal_radius), _cloud(target, normal_radius)
    features = [_fpfh(cloud, feature_radius) for cloud in clouds]
    option = registration.FastGlobalRegistrationOption(
        use_absolute_scale=True,
        decrease_mu=True,
        maximum_correspondence_distance=inlier_distance,
        tuple_test=tuple_test,
    )
    result = registration.registration_fgr_based_on_feature_matching(*clouds, *features, option)
    return _icp(*clouds, np.asarray(result.transformation), icp_distance)


def kiss_matcher_icp(
    source: Float64,
    target: Float64,
    *,
    voxel_size: float,
    sampling: bool,
    normal_gain: float,
    feature_gain: float,
    noise_gain: float,
    icp_distance: float,
) -> Float64 | None:
    """KISS-Matcher (Faster-PFH, ROBIN, graduated non-convexity); ICP by Open3D."""
    config = kiss_matcher.KISSMatcherConfig(
        voxel_size=voxel_size,
        use_voxel_sampling=sampling,
        normal_r_gain=normal_gain,
        fpfh_r_gain=feature_gain,
        robin_noise_bound_gain=noise_gain,
        enable_noise_bound_clamping=False,
    )
    matcher = kiss_matcher.KISSMatcher(config)
    solution = matcher.estimate(source.astype(np.float32), target.astype(np.float32))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = solution.rotation, np.ravel(solution.translation)
    if not np.isfinite(pose).all():
        return None
    plain = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(source))
    return _icp(plain, _cloud(target, voxel_size * normal_gain), pose, icp_distance)


def small_gicp_align(
    source: Float64,
    target: Float64,
    *,
    kind: str,
    start: str,
    correspondence_distance: float,
    downsampling: float,
) -> Float64 | None:
    """small_gicp from no rotation. start: `identity`, or `centroids` to lay them together."""
    guess = np.eye(4)
    if start == CENTRED:
        guess[:3, 3] = target.mean(0) - source.mean(0)
    result = small_gicp.align(
        target,
        source,
        init_T_target_source=guess,
        registration_type=kind,
        downsampling_resolution=downsampling,
        max_correspondence_distance=correspondence_distance,
        num_threads=1,
        max_iterations=100,
        rotation_epsilon=1e-4,
        translation_epsilon=1e-5,
    )
    return np.asarray(result.T_target_source)


def _cloud(points: Float64, normal_radius: float) -> o3d.geometry.PointCloud:
    """With normals that face away from the centroid: FPFH needs signs that turn with the cloud."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(
        o3d.geometry.KDTreeSearchParamHybrid(normal_radius, NORMAL_NEIGHBOURS),
        fast_normal_computation=False,
    )
    normals = np.asarray(cloud.normals)
    inward = ((points - points.mean(0)) * normals).sum(1) < 0
    normals[inward] *= -1
    return cloud


def _fpfh(cloud: o3d.geometry.PointCloud, radius: float) -> o3d.pipelines.registration.Feature:
    search = o3d.geometry.KDTreeSearchParamHybrid(radius, FEATURE_NEIGHBOURS)
    return o3d.pipelines.registration.compute_fpfh_feature(cloud, search)


def _icp(
    source: o3d.geometry.PointCloud,
    target: o3d.geometry.PointCloud,
    start: Float64,
    distance: float,
) -> Float64 | None:
    """Point-to-plane ICP to a target with normals, from the pose `start` (4, 4)."""
    registration = o3d.pipelines.registration
    result = registration.registration_icp(
        source,
        target,
        distance,
        start,
        registration.TransformationEstimationPointToPlane(),
        registration.ICPConvergenceCriteria(1e-7, 1e-7, 50),
    )
    pose = np.asarray(result.transformation)
    return pose if np.isfinite(pose).all() else None
