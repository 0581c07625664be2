#include "api/transport/hand_over_threads.hpp"

#include <pthread.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "api/transport/peer_socket.hpp"

namespace axisd::transport {

void HandOverThreads::start() {
  for (auto& thread : threads_) {
    thread = std::thread([this] { run(); });
    pthread_setname_np(thread.native_handle(), "axisd-hand-over");
  }
}

void HandOverThreads::hand_over(Id id, const HandOver& to, FileDescriptor connection, Watched watched) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({.id = id,
                        .to = &to,
                        .connection = std::move(connection),
                        .watched = std::move(watched),
                        .since = monotonic_now()});
  }
  changed_.notify_one();
}

bool HandOverThreads::take_back(Id id) {
  const std::lock_guard lock(mutex_);
  return std::erase_if(waiting_, [id](const Waiting& each) { return each.id == id; }) > 0;
}

void HandOverThreads::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    waiting_.clear();
    for (const auto& each : under_way_) reset(each.watched->get());
  }
  changed_.notify_all();
  for (auto& thread : threads_)
    if (thread.joinable()) thread.join();
}

std::vector<HandOverThreads::Id> HandOverThreads::keeping_others(TimePoint now) {
  const std::lock_guard lock(mutex_);
  std::vector<Id> all;
  const bool any_waits = !waiting_.empty() && now - waiting_.front().since >= patience;
  if (!any_waits || under_way_.size() < number) return all;
  for (const auto& each : under_way_)
    if (now - each.since >= patience) all.push_back(each.id);
  return all;
}

TimePoint HandOverThreads::last_progress(TimePoint now) {
  const std::lock_guard lock(mutex_);
  return waiting_.empty() ? now : std::max(taken_up_, waiting_.front().since);
}

void HandOverThreads::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    auto next = std::move(waiting_.front());
    waiting_.pop_front();
    taken_up_ = monotonic_now();
    const int watched = next.watched->get();
    const auto under_way =
        under_way_.insert(under_way_.end(), {.id = next.id, .watched = next.watched, .since = taken_up_});
    lock.unlock();
    hold_back(watched);
    (*next.to)(std::move(next.connection));
    let_go(watched);
    lock.lock();
    under_way_.erase(under_way);
  }
}

}  // namespace axisd::transport
