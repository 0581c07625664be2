#include "api/axisctl/commission/event_feed.hpp"

#include <utility>

#include "api/axisctl/commission/verdict.hpp"
#include "axisd/v1/event_service.grpc.pb.h"

namespace axisd::axisctl::commission {

EventFeed::EventFeed(const Client& client, const v1::AxisState& axis) : client_(client), axis_(axis) {
  v1::WatchEventsRequest request;
  request.add_axes(axis.axis());
  request.add_kinds(v1::EVENT_KIND_TERMINAL_EDGE);
  thread_ = std::thread([this, request] { read(request); });
  std::unique_lock lock(mutex_);
  opened_changed_.wait(lock, [this] { return opened_ || failure_.has_value(); });
  if (!failure_) return;
  lock.unlock();
  thread_.join();
  throw Failure(*failure_);
}

EventFeed::~EventFeed() {
  context_.TryCancel();
  thread_.join();
}

std::vector<v1::TerminalEdge> EventFeed::take() {
  const std::lock_guard lock(mutex_);
  if (failure_) throw Failure(*failure_);
  return std::exchange(edges_, {});
}

void EventFeed::read(const v1::WatchEventsRequest& request) {
  auto stream = client_.stream(context_, &v1::EventService::Stub::WatchEvents, request);
  for (v1::WatchEventsResponse message; stream.read(message);) {
    const std::lock_guard lock(mutex_);
    opened_ = true;
    for (const auto& event : message.events())
      if (!is_output(axis_, event.terminal_edge().terminal())) edges_.push_back(event.terminal_edge());
    opened_changed_.notify_all();
  }
  const auto status = stream.finish();
  const std::lock_guard lock(mutex_);
  failure_ = status.ok() ? Failure(ExitCode::unreachable, "the daemon ended the stream of events")
                         : client_.failure(status, axis_.axis());
  opened_changed_.notify_all();
}

}  // namespace axisd::axisctl::commission
