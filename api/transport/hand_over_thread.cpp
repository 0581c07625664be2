#include "api/transport/hand_over_thread.hpp"

#include <pthread.h>

#include <algorithm>
#include <utility>

#include "api/transport/peer_socket.hpp"

namespace axisd::transport {
namespace {

/// Changes while bytes come. The kernel counts those of TCP; on a unix socket what waits there changes while
/// both ends are at it.
std::uint64_t bytes_on(int connection) {
  const auto received = traffic_of(connection).received;
  return received > 0 ? received : unread_on(connection);
}

}  // namespace

void HandOverThread::start() {
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "axisd-hand-over");
}

void HandOverThread::hand_over(Id id, const HandOver& to, FileDescriptor connection, Watched watched) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(
        {.id = id, .to = &to, .connection = std::move(connection), .watched = std::move(watched)});
    if (!owed_since_) owed_since_ = monotonic_now();
  }
  changed_.notify_one();
}

bool HandOverThread::take_back(Id id) {
  const std::lock_guard lock(mutex_);
  return std::erase_if(waiting_, [id](const Waiting& each) { return each.id == id; }) > 0;
}

bool HandOverThread::has_waiting(Id id) {
  const std::lock_guard lock(mutex_);
  return std::ranges::find(waiting_, id, &Waiting::id) != waiting_.end();
}

void HandOverThread::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    waiting_.clear();
    if (inside_) reset(inside_->watched->get());
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::optional<HandOverThread::Kept> HandOverThread::kept_by(TimePoint now) {
  const std::lock_guard lock(mutex_);
  if (!inside_ || now - inside_->since < patience) return std::nullopt;
  const auto bytes = bytes_on(inside_->watched->get());
  const auto before = inside_->bytes.value_or(bytes);
  inside_->bytes = before;
  if (std::max(bytes, before) - std::min(bytes, before) <= little) return std::nullopt;
  return Kept{.id = inside_->id, .watched = inside_->watched};
}

TimePoint HandOverThread::last_progress(TimePoint now) {
  const std::lock_guard lock(mutex_);
  return owed_since_.value_or(now);
}

void HandOverThread::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (waiting_.empty()) {
      owed_since_.reset();
      changed_.wait(lock);
      continue;
    }
    auto next = std::move(waiting_.front());
    waiting_.pop_front();
    const auto now = monotonic_now();
    owed_since_ = now;
    const int watched = next.watched->get();
    inside_ = {.id = next.id, .watched = std::move(next.watched), .since = now};
    lock.unlock();
    hold_back(watched);
    (*next.to)(std::move(next.connection));
    let_go(watched);
    lock.lock();
    inside_.reset();
  }
}

}  // namespace axisd::transport
