// SPDX-License-Identifier: MIT
// What a vehicle believes about where its scans were taken: its odometry, or a total station that
// measured marks on its scanner.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/fields.h"
#include "core/pose.h"
#include "core/random.h"

namespace minescan {

/// How odometry errs. A step is a turn towards where it goes, a straight drive, and a turn at its
/// end (Thrun, Burgard, Fox, Probabilistic Robotics, 2005, section 5.4), each with normal noise of
/// a variance of, for turns, rotation_from_rotation * turn^2 + rotation_from_translation * drive^2,
/// and for the drive translation_from_translation * drive^2 + translation_from_rotation * (sum of
/// both turns^2). In a step with a slip the noise is multiplied.
///
/// The numbers are chosen for steps of 4 to 5 m to err by about 0.12 m and 0.02 rad in the median
/// and, of 50, by about 1.5 m and 0.2 rad at worst: the size of the errors in section 5.1 of
/// Magnusson et al. 2007. Without slips no numbers give both. That is for straight steps on level
/// ground: corners add to it, and on a rough floor the tilt that odometry does not see.
struct OdometryOptions {
  double rotation_from_rotation = 0.02;        // rad^2 per rad^2
  double rotation_from_translation = 2e-5;     // rad^2 per m^2
  double translation_from_translation = 4e-4;  // m^2 per m^2
  double translation_from_rotation = 0.02;     // m^2 per rad^2
  double slip_probability = 0.1;               // of each step
  double slip_translation = 10;                // times the noise
  double slip_rotation = 4.5;                  // times the noise
};

template <class Visitor>
void fields(OdometryOptions& o, Visitor&& field) {
  field("rotation-from-rotation", o.rotation_from_rotation, between(0, 10), "",
        "variance of a turn for each rad^2 turned");
  field("rotation-from-translation", o.rotation_from_translation, between(0, 10), "rad^2/m^2",
        "variance of a turn for each m^2 driven");
  field("translation-from-translation", o.translation_from_translation, between(0, 10), "",
        "variance of a drive for each m^2 driven");
  field("translation-from-rotation", o.translation_from_rotation, between(0, 10), "m^2/rad^2",
        "variance of a drive for each rad^2 turned");
  field("slip-probability", o.slip_probability, between(0, 1), "",
        "that the wheels slip in a step from scan to scan");
  field("slip-translation", o.slip_translation, between(0, 1000), "",
        "how many times more a drive errs in such a step");
  field("slip-rotation", o.slip_rotation, between(0, 1000), "",
        "how many times more a turn errs in such a step");
}

/// The poses T_world_scanner that the odometry of a vehicle believes in, which really was at
/// `T_world_scanner`, one pose each. It is planar: the first believed pose is the first true one
/// without its roll and pitch, each further one has the true step in x, y and yaw with errors on
/// it; height stays, roll and pitch are 0. The guess for a pair is
/// believed_target^-1 * believed_source. A step backwards is a drive backwards, not a turn about.
/// The step to pose k draws from Random(derived_seed(seed, "odometry"), k).
std::vector<Pose> odometry(const std::vector<Pose>& T_world_scanner, const OdometryOptions& options,
                           std::uint64_t seed);

/// A total station: an instrument with a fixed place that measures marks on the scanner.
struct TotalStationOptions {
  double mark_noise = 0.005;  // m, one sigma per axis; assumed
  double mark_circle = 0.4;   // m, diameter; assumed
};

template <class Visitor>
void fields(TotalStationOptions& o, Visitor&& field) {
  field("mark-noise", o.mark_noise, between(0, 1), "m",
        "one sigma of each coordinate of a measured mark");
  field("mark-circle", o.mark_circle, above_up_to(0, 10), "m",
        "diameter of the circle around the scanner with the three marks");
}

/// The three marks, metres, scanner frame: in front, behind to the left and behind to the right, at
/// the scanner's height, evenly on a circle around it. Assumed; the relative pose of two scans then
/// errs by 0.016, 0.040 and 0.080 rad in the median for a noise of 2, 5 and 10 mm.
std::array<Eigen::Vector3d, 3> total_station_marks(const TotalStationOptions& options);

/// T_world_scanner as a total station finds it: the pose that brings the marks nearest to where
/// they were measured, in the sense of least squares (Horn's absolute orientation). Draws nine
/// normal numbers.
Pose total_station_pose(const Pose& T_world_scanner, const TotalStationOptions& options,
                        Random& random);

}  // namespace minescan
