#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/exposition/exposition.hpp"
#include "daemon/core/meter.hpp"
#include "daemon/metrics/machine_families.hpp"
#include "devices/budget.hpp"
#include "devices/machine.hpp"

namespace axisd::metrics {

/// Where the figures come from. All of it may be called from any thread, and nothing waits for the core.
struct Sources {
  Machine* machine = nullptr;  ///< for what axes and devices publish; nothing else is asked of it
  std::function<core::MachineReadingPtr()> reading;  ///< not nullptr
  std::function<LatencyHistogram()> journal_syncs;
  std::vector<BusBudgetReport> budgets;                     ///< the published bounds
  std::function<std::vector<FileExpiry>()> files_expire{};  ///< of server.tls; nullptr: no TLS
};

/// What a scrape gets. Labels have the names of the configuration and constants of this program, never what a
/// client says. Thread: one at a time.
class Metrics {
 public:
  /// Whoever comes sooner gets the text of before.
  static constexpr Duration renewed_after = std::chrono::seconds(1);

  explicit Metrics(Sources sources) : sources_(std::move(sources)) {}

  /// What there is to see, at most renewed_after old.
  [[nodiscard]] std::shared_ptr<const std::string> scrape(Format format);

 private:
  struct Text {
    TimePoint made{};
    std::shared_ptr<const std::string> text;
  };
  [[nodiscard]] std::string render(Format format) const;

  Sources sources_;
  std::array<Text, 2> texts_;  ///< by Format
  std::uint64_t scrapes_ = 0;
  Duration last_took_{};
};

}  // namespace axisd::metrics
