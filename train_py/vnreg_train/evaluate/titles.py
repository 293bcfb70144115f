"""How methods are called in tables (Markdown) and plots, in their order there."""

TITLES = {
    "coarse": "coarse",
    "paper": "paper",
    "verified": "**verified**",
    "open3d_ransac_icp": "Open3D FPFH + RANSAC + ICP",
    "open3d_fgr_icp": "Open3D FPFH + FGR + ICP",
    "kiss_matcher_icp": "KISS-Matcher + ICP",
    "small_gicp": "small_gicp",
}


def plain_title(method: str) -> str:
    """Without Markdown."""
    return TITLES[method].strip("*")
