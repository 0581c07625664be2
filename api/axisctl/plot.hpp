// A recorded motion as a picture: position and velocity over time, as SVG. Pure.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace axisd::axisctl {

struct PlotSample {
  double time = 0;  ///< s; of the drive's answer
  double position = 0, velocity = 0;
  std::optional<double> target;
};

struct Plot {
  std::string title, subtitle;
  std::string unit;                 ///< of the positions; velocities are per second
  std::vector<PlotSample> samples;  ///< by time, at least one
};

/// Round numbers that lie within a range, three to seven of them.
std::vector<double> ticks(double low, double high);

/// A picture of 960 x 620, which any browser shows.
std::string svg(const Plot& plot);

}  // namespace axisd::axisctl
