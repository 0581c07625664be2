#include "api/server/watch_stream.hpp"

#include <grpcpp/server_context.h>

#include <chrono>
#include <string>
#include <utility>

#include "axisd/v1/axis_service.pb.h"
#include "buses/limited_log.hpp"

namespace axisd::server {

using std::chrono::milliseconds;

WatchStream::WatchStream(const Services& services, grpc::CallbackServerContext* context,
                         Admission::Ticket ticket, std::string instance_id, Ready on_ready)
    : reply_(services.reply),
      calls_(services.calls),
      judge_(services.callers.judge_of(*context)),
      context_(context),
      ticket_(std::move(ticket)),
      instance_id_(std::move(instance_id)),
      on_ready_(std::move(on_ready)) {}

bool WatchStream::open() {
  if (!calls_->add(shared_from_this(), context_->peer(), std::move(judge_))) return false;
  self_ = shared_from_this();
  return true;
}

void WatchStream::write(const grpc::Slice& axes, TimePoint now) {
  // Protobuf fields of two concatenated messages merge: the stream's own part goes before the shared one.
  v1::WatchAxesResponse own;
  own.set_instance_id(instance_id_);
  own.set_tick(++tick_);
  own.set_dropped(dropped_);
  const grpc::Slice slices[] = {grpc::Slice(own.SerializeAsString()), axes};
  buffer_ = grpc::ByteBuffer(slices, std::size(slices));
  owes_ = false;
  write_began_ = now;
  state_.store(State::writing, std::memory_order_release);
  StartWrite(&buffer_);
}

bool WatchStream::owe() {
  if (owes_) {
    ++dropped_;  // the owed batch is replaced by this newer one
    return true;
  }
  auto expected = State::writing;
  if (!state_.compare_exchange_strong(expected, State::owed) && expected == State::idle) return false;
  owes_ = true;
  return true;
}

void WatchStream::cancel_if_stalled(TimePoint now, Duration limit) {
  if (finished_ || cancelled_ || idle()) return;
  if (now - write_began_ <= (closing_with_ ? milliseconds(100) : limit)) return;
  cancelled_ = true;
  log_limited(spdlog::level::warn, ticket_.client(), "streams",
              fmt::format("{} stopped reading its axis stream: cancelled after {} batches, {} dropped",
                          context_->peer(), tick_, dropped_));
  context_->TryCancel();  // fails the pending write, which ends the stream
}

void WatchStream::close(const grpc::Status& status) {
  reply_->post([stream = shared_from_this(), status] { stream->begin_close(status); });
}

void WatchStream::begin_close(const grpc::Status& status) {
  if (finished_ || closing_with_) return;
  closing_with_ = status;
  auto state = state_.load(std::memory_order_acquire);
  while (state != State::idle)
    if (state_.compare_exchange_weak(state, State::closing)) return;  // OnWriteDone goes on
  state_.store(State::closing, std::memory_order_release);
  finish();
}

void WatchStream::finish() {
  if (std::exchange(finished_, true)) return;
  ticket_.release();
  calls_->answered(this);
  Finish(closing_with_.value_or(grpc::Status::CANCELLED));
}

void WatchStream::OnWriteDone(bool ok) {
  // Once closing, never idle again: nothing may be written between here and Finish.
  if (!ok) state_.store(State::closing, std::memory_order_release);
  auto before = state_.load(std::memory_order_acquire);
  while (before != State::closing && !state_.compare_exchange_weak(before, State::idle)) {
  }
  if (before == State::closing) {
    reply_->post([stream = shared_from_this()] { stream->finish(); });
  } else if (before == State::owed) {
    reply_->post([stream = shared_from_this()] {
      if (stream->owes_ && stream->idle()) stream->on_ready_(stream);
    });
  }
}

void WatchStream::OnCancel() { close(grpc::Status::CANCELLED); }

void WatchStream::OnDone() {
  calls_->remove(this);
  const auto last = std::move(self_);  // may end this object, after this function
}

}  // namespace axisd::server
