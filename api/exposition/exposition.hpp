#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

#include "buses/latency_histogram.hpp"

namespace axisd::metrics {

/// How metrics are written down.
enum class Format : std::uint8_t {
  text,         ///< Prometheus text, version 0.0.4
  openmetrics,  ///< OpenMetrics 1.0.0
};
std::string_view content_type(Format format);

enum class MetricType : std::uint8_t {
  counter,  ///< its name ends with _total
  gauge,
  histogram,  ///< of durations, in seconds
  info,       ///< always 1; its labels are what it says; its name ends with _info
};

/// Names and values of one sample, as they are written. Values may hold anything.
class Labels {
 public:
  /// `name`: a constant of this program, [a-z_]+.
  [[nodiscard]] Labels with(std::string_view name, std::string_view value) const;
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// Writes metrics, family by family. Pure.
class Exposition {
 public:
  explicit Exposition(Format format) : format_(format) {}

  /// What follows is of this family. `name`: in full, as a query has it. `help`: a constant of this program,
  /// on one line.
  void family(std::string_view name, MetricType type, std::string_view help);
  void sample(const Labels& labels, double value);
  void sample(const Labels& labels, std::integral auto value) {
    integer(labels, static_cast<std::int64_t>(value));
  }
  /// Of a family of histograms. Every fourth bucket, so that each bound is twice the one before it.
  void histogram(const Labels& labels, const LatencyHistogram& durations);
  /// All of it. Once.
  [[nodiscard]] std::string take();

 private:
  void integer(const Labels& labels, std::int64_t value);
  void begin_line(std::string_view suffix, const std::string& labels);

  Format format_;
  std::string name_;  ///< of the family
  std::string text_;
};

/// In seconds, as all times are.
[[nodiscard]] double in_seconds(Duration duration);

}  // namespace axisd::metrics
