#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "api/transport/memory_trimmer.hpp"
#include "api/transport/trim_plan.hpp"
#include "buses/clock.hpp"

namespace axisd::transport {

/// What connections cost this process in memory: it has a limit, and what is free is given back. TrimPlan and
/// MemoryTrimmer decide and do it. Thread: the accept loop's, but for start() and stop().
class MemoryKeeper {
 public:
  /// Once. `limit`: bytes.
  void start(std::size_t limit);
  /// Waits for what is under way. Idempotent.
  void stop() { trimmer_.stop(); }
  /// A connection has left that had begun so many.
  void gone(std::int64_t streams) { streams_gone_ += streams; }
  /// Who had much is being cut off.
  void let_go(TimePoint now) { plan_->let_go(now); }
  /// To be called often; looks now and then. `beyond`: called where there is more than the limit.
  void look(TimePoint now, const std::function<void()>& beyond);

 private:
  std::size_t limit_ = 0;
  MemoryTrimmer trimmer_;
  std::optional<TrimPlan> plan_;
  std::int64_t streams_gone_ = 0;  ///< since what they had was given back
  TimePoint looked_{};
};

}  // namespace axisd::transport
