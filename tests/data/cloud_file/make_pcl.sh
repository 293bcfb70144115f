#!/usr/bin/env bash
# Writes the files pcl_* beside it again: the points of points.xyz, by the Point Cloud Library.
# Needs Debian's package pcl-tools, which draws in too much for `make test`.
set -euo pipefail
cd "$(dirname "$0")"
pcl_xyz2pcd points.xyz pcl_xyz2pcd.pcd
pcl_convert_pcd_ascii_binary pcl_xyz2pcd.pcd pcl_ascii.pcd 0
pcl_convert_pcd_ascii_binary pcl_xyz2pcd.pcd pcl_binary.pcd 1
pcl_convert_pcd_ascii_binary pcl_xyz2pcd.pcd pcl_compressed.pcd 2
pcl_normal_estimation pcl_binary.pcd pcl_normals.pcd -k 8
pcl_pcd2ply -format 0 pcl_binary.pcd pcl_ascii.ply
pcl_pcd2ply -format 1 pcl_binary.pcd pcl_binary.ply
