#include "api/transport/hand_over_thread.hpp"

#include <fcntl.h>
#include <pthread.h>

#include <utility>

#include "api/transport/peer_socket.hpp"

namespace axisd::transport {

void HandOverThread::start() {
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "axisd-hand-over");
}

void HandOverThread::hand_over(std::uint64_t id, const HandOver& to, FileDescriptor connection) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({.id = id, .to = &to, .connection = std::move(connection)});
  }
  changed_.notify_one();
}

void HandOverThread::take_back(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [id](const Waiting& each) { return each.id == id; });
}

void HandOverThread::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    waiting_.clear();
    if (under_way_.get() >= 0) reset(under_way_.get());
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void HandOverThread::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    auto next = std::move(waiting_.front());
    waiting_.pop_front();
    under_way_ = FileDescriptor(fcntl(next.connection.get(), F_DUPFD_CLOEXEC, 0));
    lock.unlock();
    (*next.to)(std::move(next.connection));
    lock.lock();
    under_way_ = {};
  }
}

}  // namespace axisd::transport
