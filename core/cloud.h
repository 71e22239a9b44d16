// SPDX-License-Identifier: MIT
// The values that flow between the folders: triangle meshes of mines, point clouds, and scans with
// their exact truth. Structs of arrays; an optional attribute is an empty array.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/pose.h"

namespace minescan {

/// Points in metres. The frame is named by the holder: `target`, `source`, `scan.cloud`.
struct PointCloud {
  std::vector<Eigen::Vector3d> points = {};
  std::vector<Eigen::Vector3d> normals = {};  // empty, or one unit vector per point
};

/// What a surface does to light, and what of its relief the triangles leave out.
struct Material {
  std::string name = {};
  double reflectance = 0.35;  // diffuse, when dry, at the scanner's wavelength, in (0, 1]
  double wetness = 0;         // 0 dry, 1 wet
  double roughness = 0;       // metres, RMS height of the relief finer than the mesh
  double fine_slope = 0;      // its RMS slope along a line
};

/// What a surface reflects: wet rock about half of dry rock (measured).
inline double wet_reflectance(const Material& m) { return m.reflectance * (1 - m.wetness / 2); }

/// Triangles with shared vertices, world frame, metres. Seen from free space the vertices of a
/// triangle run counter-clockwise, so normals point into the open mine.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices = {};
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
  std::vector<std::uint8_t> material = {};  // one index into `materials` per triangle
  std::vector<Material> materials = {};     // at most 256
};

/// What happened to a measured point; bits of Scan::flags.
enum ScanFlag : std::uint8_t {
  flag_none = 0,
  flag_mixed_pixel = 1,  // the beam's footprint met more than one surface
  flag_wrapped = 2,      // beyond the ambiguity interval: the range is short by a multiple of it
  flag_outlier = 4,      // a wrong period of a tone: the range has little to do with the surface
  flag_saturated = 8,    // the signal was stronger than the receiver takes
};

/// What one scanner saw, with the exact truth beside every measured point. The per-point arrays
/// have as many entries as cloud.points, plane by plane and beam by beam. Beams without return are
/// not listed; a beam with several returns is listed once for each, by range.
///
/// The frame of the scan is the scanner's at its start (time 0). A scanner that moves does not know
/// that it does: its measured points are where they would be had it stood still, the true ones
/// where they are.
struct Scan {
  std::string scene = {};    // name of the scene
  std::string scanner = {};  // name of the scanner
  std::uint64_t seed = 0;

  Pose T_world_scanner = Pose::Identity();  // exact, at time 0 of the scan
  PointCloud cloud = {};                    // measured, scanner frame

  std::vector<float> intensity = {};       // received amplitude, 1 = white plate at 1 m
  std::vector<double> time = {};           // seconds since the start of the scan
  std::vector<std::uint32_t> ring = {};    // index of the beam in its plane
  std::vector<std::uint32_t> column = {};  // index of the plane
  std::vector<double> range = {};          // metres, as measured
  std::vector<double> true_range = {};     // metres, along the beam as it really pointed
  // Where the beam really met the surface, in the frame of the scan.
  std::vector<Eigen::Vector3f> true_point = {};
  std::vector<float> incidence = {};  // radians between beam and surface normal
  // Of the surface, with relief finer than the triangle; scanner frame, towards the scanner.
  std::vector<Eigen::Vector3f> true_normal = {};
  std::vector<std::uint32_t> triangle = {};  // index into the scene's triangles
  std::vector<std::uint8_t> material = {};   // index into the scene's materials
  std::vector<std::uint8_t> flags = {};      // of ScanFlag
  std::vector<std::uint8_t> echo = {};       // which return of its beam, by range: 1, 2, ...

  // The grid of beams; both 0 where beams lie on none.
  std::uint32_t rings = 0;    // beams per plane
  std::uint32_t columns = 0;  // planes
  std::uint64_t beams = 0;    // fired, with or without return
};

}  // namespace minescan
