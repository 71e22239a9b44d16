// SPDX-License-Identifier: MIT
// Pictures of scans, for people to look at: the grid of beams, and the measured points in space.
#pragma once

#include "core/cloud.h"
#include "sim/picture.h"

namespace minescan {

/// The first returns of a scan on the grid of its beams, twice: above by amplitude (logarithmic,
/// from dark blue for little to yellow), below by measured range (from yellow, near, to dark blue).
/// Beams without return are dark. The legends tell the range of values, which the outermost 2 % of
/// the returns exceed.
///
/// rows    of the picture are rings, columns planes from the left; or, with `rings_across`, rings
///         from the right and planes from the bottom, as a plane that tilts upwards sees the mine
/// width   pixels; the height follows from the grid but is at least a sixth and at most 3/4 of it,
///         for each of the two
/// throws  std::invalid_argument for a scan without grid or returns, or a width that is not in
///         [300, 16384]
Picture grid_picture(const Scan& scan, bool rings_across, int width);

/// The measured points from the right, behind and above (30 degrees), in parallel projection,
/// coloured by amplitude as above. Surfaces that turn away from there, as ceilings and the nearer
/// walls do, are dark and behind all others. Points of mixed pixels, wrong periods and wrapped
/// ranges are larger, of colours of their own, and in front of all; the legend counts them. The
/// frame holds the other points with a margin; the legend counts what is beyond.
///
/// width   pixels; the height follows from the points, at most as much
/// throws  std::invalid_argument for a scan without points, or a width that is not in [300, 16384]
Picture points_picture(const Scan& scan, int width);

}  // namespace minescan
