#include "api/axisctl/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

constexpr double width = 960, height = 620;
constexpr double left = 90, right = 930, top = 84, panel_height = 220, gap = 26;
constexpr double lowest_share = 0.06;  ///< of a panel that stays empty above and below its line

struct Range {
  double low = 0, high = 0;

  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// With room around it; something that never changes gets a range all the same.
  [[nodiscard]] Range padded() const {
    const double room =
        high > low ? (high - low) * lowest_share : std::max(1.0, std::abs(high) * lowest_share);
    return {low - room, high + room};
  }
};

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

/// One of the two diagrams: its place, its scales, and what is drawn into it.
class Panel {
 public:
  Panel(double y, Range times, Range values) : y_(y), times_(times), values_(values.padded()) {}

  void axes(std::string& out, const std::string& label, bool with_times) const {
    for (const double value : ticks(values_.low, values_.high)) {
      out += fmt::format("<path class='grid' d='M{:.1f} {:.1f}H{:.1f}'/>\n", left, y_of(value), right);
      out += fmt::format("<text x='{:.1f}' y='{:.1f}' class='tick' text-anchor='end'>{}</text>\n", left - 8,
                         y_of(value) + 4, number(value));
    }
    for (const double time : ticks(times_.low, times_.high)) {
      out +=
          fmt::format("<path class='grid' d='M{:.1f} {:.1f}V{:.1f}'/>\n", x_of(time), y_, y_ + panel_height);
      if (with_times)
        out += fmt::format("<text x='{:.1f}' y='{:.1f}' class='tick' text-anchor='middle'>{}</text>\n",
                           x_of(time), y_ + panel_height + 18, number(time));
    }
    out += fmt::format("<rect class='frame' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'/>\n", left,
                       y_, right - left, panel_height);
    out += fmt::format(
        "<text class='label' text-anchor='middle' transform='translate(24 {:.1f}) rotate(-90)'>{}</text>\n",
        y_ + panel_height / 2, escaped(label));
  }

  /// A line through the samples that have a value.
  template <class Value>
  void line(std::string& out, const Plot& plot, const char* style, Value&& value) const {
    std::string path;
    bool pen_down = false;
    for (const auto& sample : plot.samples) {
      const std::optional<double> y = value(sample);
      if (y) path += fmt::format("{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', x_of(sample.time), y_of(*y));
      pen_down = y.has_value();
    }
    out += fmt::format("<path class='{}' d='{}'/>\n", style, path);
  }

  /// Its n-th entry, above the panel's right end.
  void legend(std::string& out, int n, const char* style, const char* text) const {
    const double x = right - 96.0 * (n + 1);
    out += fmt::format(
        "<path class='{}' d='M{:.1f} {:.1f}h24'/><text class='tick' x='{:.1f}' y='{:.1f}'>{}</text>\n", style,
        x, y_ - 9, x + 30, y_ - 5, text);
  }

 private:
  [[nodiscard]] double x_of(double time) const {
    return left + (right - left) * (time - times_.low) / std::max(times_.high - times_.low, 1e-9);
  }
  [[nodiscard]] double y_of(double value) const {
    return y_ + panel_height * (values_.high - value) / (values_.high - values_.low);
  }

  double y_;
  Range times_, values_;
};

constexpr const char* head =
    R"(<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}'>
<style>
text {{ font-family: sans-serif; fill: #222; }}
.title {{ font-size: 19px; font-weight: bold; }}
.subtitle, .label {{ font-size: 13px; fill: #555; }}
.tick {{ font-size: 12px; fill: #555; }}
path, rect {{ fill: none; }}
.grid {{ stroke: #e4e4e4; }}
.frame {{ stroke: #999; }}
.position {{ stroke: #1668a8; stroke-width: 2; stroke-linejoin: round; }}
.velocity {{ stroke: #c2501a; stroke-width: 2; stroke-linejoin: round; }}
.target {{ stroke: #888; stroke-width: 1.5; stroke-dasharray: 6 4; }}
</style>
<rect width='{0}' height='{1}' style='fill: white'/>
<text x='{2}' y='34' class='title'>{3}</text>
<text x='{2}' y='56' class='subtitle'>{4}</text>
)";

}  // namespace

std::vector<double> ticks(double low, double high) {
  const double rough = std::max(high - low, 1e-9) / 7;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * power >= rough * 0.999) step = factor * power;
  std::vector<double> result;
  for (double count = std::ceil(low / step); count * step <= high; ++count) result.push_back(count * step);
  return result;
}

std::string svg(const Plot& plot) {
  const auto& first = plot.samples.front();
  Range positions{first.position, first.position};
  Range velocities;  // 0 belongs to it: that is where the axis rests
  bool with_target = false;
  for (const auto& sample : plot.samples) {
    positions.include(sample.position);
    velocities.include(sample.velocity);
    if (sample.target) positions.include(*sample.target);
    with_target |= sample.target.has_value();
  }
  const Range times{first.time, plot.samples.back().time};
  const Panel above(top, times, positions);
  const Panel below(top + panel_height + gap, times, velocities);

  std::string out = fmt::format(head, width, height, left, escaped(plot.title), escaped(plot.subtitle));
  above.axes(out, "position, " + plot.unit, false);
  below.axes(out, "velocity, " + plot.unit + "/s", true);
  if (with_target) above.line(out, plot, "target", [](const PlotSample& sample) { return sample.target; });
  above.line(out, plot, "position", [](const PlotSample& sample) { return sample.position; });
  below.line(out, plot, "velocity", [](const PlotSample& sample) { return sample.velocity; });
  above.legend(out, 0, "velocity", "velocity");
  above.legend(out, 1, "position", "position");
  if (with_target) above.legend(out, 2, "target", "target");
  out +=
      fmt::format("<text x='{:.1f}' y='{:.1f}' class='label' text-anchor='middle'>time, s</text>\n</svg>\n",
                  (left + right) / 2, top + 2 * panel_height + gap + 40);
  return out;
}

}  // namespace axisd::axisctl
