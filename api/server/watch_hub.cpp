#include "api/server/watch_hub.hpp"

#include <google/protobuf/util/field_mask_util.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "api/server/convert.hpp"
#include "api/server/status.hpp"
#include "api/server/validate.hpp"

namespace axisd::server {
namespace {

using std::chrono::milliseconds;

// A batch this young may serve a stream that begins or catches up between two ticks, unless something was
// published.
constexpr Duration shareable = milliseconds(5);
constexpr Duration stall_check_period = milliseconds(100);

// The next multiple of the period after `now`: a late tick is skipped, never caught up in a burst.
TimePoint next_tick(TimePoint now, Duration period) {
  return TimePoint((now.time_since_epoch() / period + 1) * period);
}

bool same(const WatchScope& a, const WatchScope& b) {
  return a.period == b.period && a.axes == b.axes && std::ranges::equal(a.fields.paths(), b.fields.paths());
}

}  // namespace

grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchHub::open(const Services& services,
                                                           grpc::CallbackServerContext* context,
                                                           Admission::Ticket ticket, WatchScope scope) {
  const auto stream =
      std::make_shared<WatchStream>(services, context, std::move(ticket), machine_.info().instance_id,
                                    [this](const std::shared_ptr<WatchStream>& ready) { pay(ready); });
  if (!stream->open()) return nullptr;
  reply_->post([this, stream, scope = std::move(scope)]() mutable { add(stream, std::move(scope)); });
  return stream.get();
}

void WatchHub::add(const std::shared_ptr<WatchStream>& stream, WatchScope scope) {
  if (stream->ended()) return;
  const auto now = monotonic_now();
  auto found = std::ranges::find_if(groups_, [&](const auto& group) { return same(group->scope, scope); });
  if (found == groups_.end()) {
    const auto due = next_tick(now, scope.period);
    groups_.push_back(
        std::make_unique<Group>(Group{.scope = std::move(scope), .due = due, .streams = {}, .batch = {}}));
    found = groups_.end() - 1;
  }
  auto& group = **found;
  group.streams.push_back(stream);
  refresh(group, now);
  stream->write(group.batch, now);
}

TimePoint WatchHub::tick(TimePoint now) {
  if (groups_.empty()) return TimePoint::max();
  if (now >= next_stall_check_) look_for_stalls(now);
  auto next = next_stall_check_;
  for (auto& group : groups_) {
    if (now >= group->due) run(*group, now);
    next = std::min(next, group->due);
  }
  return next;
}

void WatchHub::run(Group& group, TimePoint now) {
  group.due = next_tick(now, group.scope.period);
  std::erase_if(group.streams, [](const auto& stream) { return stream->ended(); });
  if (!end_without(group)) return;
  bool made = false;
  for (const auto& stream : group.streams) {
    if (!stream->idle() && stream->owe()) continue;
    // Serialised for the first reader that can take it: nobody pays for a batch that none does.
    if (!std::exchange(made, true)) serialise(group, now);
    stream->write(group.batch, now);
  }
}

bool WatchHub::end_without(Group& group) {
  for (const auto& axis : group.scope.axes) {
    const auto found = find_axis(machine_, axis);
    if (found) continue;
    for (const auto& stream : group.streams) stream->close(to_status(found.error()));
    return false;
  }
  return true;
}

void WatchHub::pay(const std::shared_ptr<WatchStream>& stream) {
  const auto now = monotonic_now();
  for (auto& group : groups_) {
    if (std::ranges::find(group->streams, stream) == group->streams.end()) continue;
    refresh(*group, now);
    stream->write(group->batch, now);
    return;
  }
}

void WatchHub::refresh(Group& group, TimePoint now) {
  if (group.batch_published == published_.load(std::memory_order_acquire) &&
      now - group.batch_made < shareable)
    return;
  serialise(group, now);
}

/// At a high rate few axes have changed since the last batch: of the others only the times have.
void WatchHub::show(Shown& shown, AxisSnapshotPtr snapshot, const WatchScope& scope, TimePoint now) {
  if (shown.snapshot == snapshot) {
    update_times(*snapshot, now, *shown.state);
    return;
  }
  shown.state->Clear();
  to_proto(*snapshot, now, *shown.state);
  if (!scope.fields.paths().empty())
    google::protobuf::util::FieldMaskUtil::TrimMessage(scope.fields, shown.state);
  shown.snapshot = std::move(snapshot);
}

void WatchHub::serialise(Group& group, TimePoint now) {
  group.batch_published =
      published_.load(std::memory_order_acquire);  // before the snapshots: at worst one too many
  group.batch_made = now;
  auto& states = *group.message.mutable_axes();
  const auto machine_now = machine_.now();
  std::size_t count = 0;
  const auto axes = group.scope.axes.empty() ? machine_.axis_names() : group.scope.axes;
  for (const auto& axis : axes)
    if (auto snapshot = machine_.snapshot(axis)) {
      if (count == group.shown.size()) group.shown.push_back({.state = states.Add()});
      show(group.shown[count++], std::move(snapshot), group.scope, machine_now);
    }
  for (; group.shown.size() > count; group.shown.pop_back()) states.RemoveLast();
  // Serialised straight into the slice's own memory, which nobody else has seen yet.
  const grpc::Slice slice(group.message.ByteSizeLong());
  group.message.SerializeWithCachedSizesToArray(const_cast<std::uint8_t*>(slice.begin()));
  group.batch = slice;
  batches_.fetch_add(1, std::memory_order_relaxed);
}

void WatchHub::look_for_stalls(TimePoint now) {
  next_stall_check_ = now + stall_check_period;
  for (auto& group : groups_) {
    std::erase_if(group->streams, [](const auto& stream) { return stream->ended(); });
    for (const auto& stream : group->streams) stream->cancel_if_stalled(now, stalled_reader_limit_);
  }
  std::erase_if(groups_, [](const auto& group) { return group->streams.empty(); });
}

}  // namespace axisd::server
