// https://prometheus.io/docs/instrumenting/exposition_formats/ and the OpenMetrics specification 1.0.0.
#include "api/exposition/exposition.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "buses/seconds.hpp"

namespace axisd::metrics {
namespace {

constexpr std::size_t buckets_in_one = 4;

/// `name` without what its type puts behind it.
std::string_view without_suffix(std::string_view name, MetricType type) {
  const std::string_view suffix = type == MetricType::counter ? "_total" : "_info";
  if (type == MetricType::counter || type == MetricType::info) name.remove_suffix(suffix.size());
  return name;
}

std::string_view type_name(MetricType type, Format format) {
  switch (type) {
    case MetricType::counter:
      return "counter";
    case MetricType::gauge:
      return "gauge";
    case MetricType::histogram:
      return "histogram";
    case MetricType::info:
      return format == Format::openmetrics ? "info" : "gauge";
  }
  return "unknown";
}

void write_number(std::string& to, double value) {
  if (std::isfinite(value))
    fmt::format_to(std::back_inserter(to), "{}", value);
  else
    to += std::isnan(value) ? "NaN" : value < 0 ? "-Inf" : "+Inf";
}

}  // namespace

std::string_view content_type(Format format) {
  return format == Format::openmetrics ? "application/openmetrics-text; version=1.0.0; charset=utf-8"
                                       : "text/plain; version=0.0.4; charset=utf-8";
}

double in_seconds(Duration duration) {
  if (duration == Duration::max()) return std::numeric_limits<double>::infinity();
  return axisd::in_seconds(duration);
}

Labels Labels::with(std::string_view name, std::string_view value) const {
  Labels more = *this;
  auto& text = more.text_;
  if (!text.empty()) text += ',';
  text.append(name).append("=\"");
  for (const char c : value) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') text += '\\';
    text += c;
  }
  text += '"';
  return more;
}

void Exposition::family(std::string_view name, MetricType type, std::string_view help) {
  name_ = name;
  const auto family = format_ == Format::openmetrics ? without_suffix(name, type) : name;
  fmt::format_to(std::back_inserter(text_), "# HELP {} {}\n# TYPE {} {}\n", family, help, family,
                 type_name(type, format_));
}

void Exposition::begin_line(std::string_view suffix, const std::string& labels) {
  text_.append(name_).append(suffix);
  if (!labels.empty()) text_.append("{").append(labels).append("}");
  text_ += ' ';
}

void Exposition::sample(const Labels& labels, double value) {
  begin_line({}, labels.text());
  write_number(text_, value);
  text_ += '\n';
}

void Exposition::integer(const Labels& labels, std::int64_t value) {
  begin_line({}, labels.text());
  fmt::format_to(std::back_inserter(text_), "{}\n", value);
}

void Exposition::histogram(const Labels& labels, const LatencyHistogram& durations) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < LatencyHistogram::bucket_count; ++i) {
    count += durations.counts().at(i);
    const bool last = i + 1 == LatencyHistogram::bucket_count;
    if (i % buckets_in_one != 0 && !last) continue;
    const auto bound = last ? std::string("+Inf") : fmt::format("{}", in_seconds(LatencyHistogram::bound(i)));
    begin_line("_bucket", labels.with("le", bound).text());
    fmt::format_to(std::back_inserter(text_), "{}\n", count);
  }
  begin_line("_sum", labels.text());
  write_number(text_, in_seconds(durations.sum()));
  text_ += '\n';
  begin_line("_count", labels.text());
  fmt::format_to(std::back_inserter(text_), "{}\n", count);
}

std::string Exposition::take() {
  if (format_ == Format::openmetrics) text_ += "# EOF\n";
  return std::move(text_);
}

}  // namespace axisd::metrics
