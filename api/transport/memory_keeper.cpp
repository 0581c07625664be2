#include "api/transport/memory_keeper.hpp"

#include "buses/heartbeat.hpp"

namespace axisd::transport {
namespace {

constexpr Duration period = heartbeat;
/// Of connections that have left: they took more than is worth giving back.
constexpr std::int64_t many_streams = 1024;

}  // namespace

void MemoryKeeper::start(std::size_t limit) {
  limit_ = limit;
  plan_.emplace(resident_memory());
  trimmer_.start();
}

void MemoryKeeper::look(TimePoint now, const std::function<void()>& beyond) {
  if (now - looked_ < period) return;
  looked_ = now;
  const auto bytes = resident_memory();
  if (bytes > limit_) beyond();
  if (streams_gone_ >= many_streams) {
    streams_gone_ = 0;
    plan_->let_go(now);
  }
  if (const auto left = trimmer_.take_left(); left > 0) plan_->trimmed(left);
  if (plan_->due(now, bytes)) trimmer_.trim();
}

}  // namespace axisd::transport
