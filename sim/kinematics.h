// SPDX-License-Identifier: MIT
// Where the beams of a scanner go, and when: as the instrument believes, and as they really go.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "sim/packet.h"
#include "sim/scanner.h"

namespace minescan {

/// A beam in the scanner frame.
struct Beam {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();      // metres
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // unit
  Eigen::Vector3d along = Eigen::Vector3d::UnitY();      // unit, across the beam, the way it sweeps
};

/// The beams of one scanner, with what is the same for all of them computed once.
///
/// A beam of a mirror is v(a) = cos(a) start + sin(a) sideways in the frame of its plane, where
/// (start, sideways) are (up, forward) for yaw and (forward, left) else, and a is the mirror angle.
/// From there it goes through the mirror's mount and the turning head into the scanner frame:
///   direction = R_head(theta) R_mount v(a),  origin = R_head(theta) lever.
/// The true beam differs by a += index + eccentricity sin(a) + jitter, by leaving the plane by
/// wobble sin(a) + 2 mirror_tilt, by theta += motion jitter, and by a leaning axis.
class Kinematics {
 public:
  /// Of a scanner that `check` accepts.
  explicit Kinematics(const Scanner& scanner);

  /// Seconds from the start of the scan to beam `ring` of plane `column`.
  double time(int ring, int column) const {
    const int k = scanner_.interlace;
    const int turn = k == 1 ? 0 : ring % k;
    return (static_cast<double>(column) * k + turn) * turn_time_ + ring * scanner_.beam_time;
  }

  /// Seconds from the start of the scan to the end of its last sweep.
  double duration() const;

  /// How the head stands while it sweeps a plane.
  struct Plane {
    int column = 0;
    Eigen::Matrix3d nominal = Eigen::Matrix3d::Identity();  // R_scanner_plane
    Eigen::Matrix3d actual = Eigen::Matrix3d::Identity();
  };
  /// `jitter`: a standard normal number.
  Plane plane(int column, double jitter) const;

  /// Whether beams leave from elsewhere than the origin of the scanner frame.
  bool has_lever() const { return has_lever_; }

  /// Where the instrument believes that beam `ring` of a plane goes.
  Beam nominal(const Plane& plane, int ring) const {
    if (scanner_.pattern != Pattern::mirror) return without_mirror(plane.column, ring);
    const Ring& r = rings_[static_cast<std::size_t>(ring)];
    return {origin(plane.nominal, r), plane.nominal * r.nominal, plane.nominal * r.turned};
  }
  /// Where it goes; `jitter` is a standard normal number, the encoder's.
  Beam actual(const Plane& plane, int ring, double jitter) const {
    if (scanner_.pattern != Pattern::mirror) return without_mirror(plane.column, ring);
    const Ring& r = rings_[static_cast<std::size_t>(ring)];
    return {origin(plane.actual, r), plane.actual * direction(r, jitter), plane.actual * r.turned};
  }

  /// The same for a beam in each of 16 lanes: beam rings[i] of the plane that heads were set to in
  /// lane i.
  struct Heads {
    std::array<int, lanes> column;
    MatrixLanes nominal, actual;

    void set(std::size_t i, const Plane& plane) {
      column[i] = plane.column;
      nominal.set(i, plane.nominal);
      actual.set(i, plane.actual);
    }
  };
  struct Beams {
    VectorLanes origin, direction;
  };
  using Rings = std::array<int, lanes>;
  void nominal(const Heads& heads, const Rings& rings, Beams& beams) const;
  void actual(const Heads& heads, const Rings& rings, const Lanes& jitter, Beams& beams) const;
  /// Beam::along of the same.
  void along(const Heads& heads, const Rings& rings, VectorLanes& along) const;

 private:
  // A beam of a mirror before the head turns it: `beam` as it is but for jitter, `turned` the same
  // a right angle onwards, `fixed` its part out of the plane, where the mirror's turning leads
  // nowhere.
  struct Ring {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    Eigen::Vector3d nominal = Eigen::Vector3d::Zero();
    Eigen::Vector3d beam = Eigen::Vector3d::Zero();
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();
    Eigen::Vector3d fixed = Eigen::Vector3d::Zero();
  };

  // Before the head turns it.
  Eigen::Vector3d direction(const Ring& r, double jitter) const {
    if (scanner_.encoder_jitter <= 0) return r.fixed + r.beam;
    // The sine of the angle: for all jitters that make sense, the angle.
    const double sine = scanner_.encoder_jitter * jitter;
    return r.fixed + std::sqrt(1 - sine * sine) * r.beam + sine * r.turned;
  }
  Eigen::Vector3d origin(const Eigen::Matrix3d& head, const Ring& ring) const {
    if (!has_lever_) return Eigen::Vector3d::Zero();
    return head * ring.origin;
  }
  Beam without_mirror(int column, int ring) const;
  // One vector of the ring in each lane, of(ring, lane), turned by the heads.
  template <class Of>
  void turned(const MatrixLanes& head, const Rings& rings, const Of& of, VectorLanes& result) const;
  // Origins of the beams in 16 lanes.
  void origins(const MatrixLanes& head, const Rings& rings, VectorLanes& origins) const;

  Scanner scanner_;
  double turn_time_ = 0;
  bool has_lever_ = false;
  std::vector<Ring> rings_ = {};  // of a mirror
};

}  // namespace minescan
