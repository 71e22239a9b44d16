// SPDX-License-Identifier: MIT
// What every method does around its own work: checks, local frames, times, and what a failed
// registration returns.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"

namespace minescan {

/// Throws std::invalid_argument if a number of `options` is outside the range that its `fields`
/// state: options set in code are held to the same limits as those that come as text.
template <class Options>
void check_options(Options options) {
  fields(options, FieldVisitor{[]<class T>(const char* name, const T& v, const Range& range,
                                           const char*, const char*) {
           if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
             const std::string text = value_text(v);
             read_named(name, text, [&] { read_number(text, range, std::is_integral_v<T>); });
           }
         }});
}

/// Throws std::invalid_argument that names the cloud (and the point) if one is empty, has more than
/// 2^32 - 1 points or a coordinate that is not finite, or if the guess is not a finite pose.
void check_clouds(const PointCloud& target, const PointCloud& source, const Pose& T_guess);

/// Runs `work` on two clouds and returns what it made of the result, which it is given with the
/// status max_iterations, the pose T_guess and the numbers of points.
///
/// Clouds far from their origins (500 m or more: map coordinates) are moved near them first, the
/// target by multiples of 1024 m, the source by whole metres, and the pose and covariance are given
/// back for the original frames (directions stay about the moved origin): turning about an origin
/// 1e6 m away would leave nothing of the digits, and no search would find the way.
///
/// A result no_overlap or degenerate gets the pose T_guess, to the last bit.
///
/// throws  as check_clouds; std::runtime_error if `work` ends at a pose that is not finite
RegistrationResult registered(
    const PointCloud& target, const PointCloud& source, const Pose& T_guess,
    const std::function<void(const PointCloud& target, const PointCloud& source,
                             RegistrationResult& result)>& work);

/// The same for `work` with options, which are checked first.
template <class Options>
RegistrationResult registered(const PointCloud& target, const PointCloud& source,
                              const Pose& T_guess, const Options& options,
                              void (*work)(const PointCloud& target, const PointCloud& source,
                                           const Options& options, RegistrationResult& result)) {
  check_options(options);
  return registered(
      target, source, T_guess,
      [&](const PointCloud& near_target, const PointCloud& near_source,
          RegistrationResult& result) { work(near_target, near_source, options, result); });
}

/// What a method of others brings together, and so what fixes a pose for it.
enum class Matches { points, surfaces };

/// Sets the status of a result that a method of others ended at: no_overlap if a cloud has fewer
/// than 6 points, degenerate if all of one lie on a line or, for surfaces, in a plane, to rounding.
void doubt(const PointCloud& target, const PointCloud& source, const Pose& T_guess, Matches what,
           RegistrationResult& result);

/// As `registered`, for libraries of others, which call anything converged. What is asked of the
/// clouds afterwards is not in the times, which are those of the others.
template <class Options>
RegistrationResult registered_by_peer(const PointCloud& target, const PointCloud& source,
                                      const Pose& T_guess, const Options& options, Matches what,
                                      void (*work)(const PointCloud& target,
                                                   const PointCloud& source, const Options& options,
                                                   RegistrationResult& result)) {
  RegistrationResult result = registered(target, source, T_guess, options, work);
  doubt(target, source, T_guess, what, result);
  return result;
}

/// How many of the `used` points (or cells) must have a partner, else the status is no_overlap:
/// `min_overlap` of them, and 6, as many as a pose has freedoms.
double needed_points(std::size_t used, double min_overlap);

/// no_overlap if fewer than `needed` were met, degenerate if the first of result.directions is held
/// less than min_rank, else converged or max_iterations.
Status status_of(const RegistrationResult& result, std::size_t met, double needed, double min_rank,
                 bool converged);

/// How firmly each of six orthogonal directions is held, the one held least first.
///
/// information  6 x 6, symmetric, of (tau, omega): how the surfaces hold the pose
/// length       metres by which omega is multiplied so that all six unknowns are lengths: the RMS
///              distance of the points from the source's origin
std::vector<Direction> directions_of(const Matrix6d& information, double length);

/// What moves most under `step`: "along" or "across" the tunnel, or "vertical", with "turn about "
/// before it where the rotation moves the points further than the translation. `axis` is the
/// tunnel's direction in the target frame, z up, and not vertical.
std::string direction_name(const Direction& direction, const Eigen::Vector3d& axis);

}  // namespace minescan
