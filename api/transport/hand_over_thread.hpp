// Connections on their way to gRPC.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "buses/file_descriptor.hpp"

namespace axisd::transport {

/// Gives gRPC its connections, one after the other, as gRPC takes them. It takes one in by reading from it on
/// the thread that brings it, and goes on for as long as there is something to read: who sends without a
/// pause keeps that thread. So it does nothing else, and the accept loop, which cuts off who floods, never
/// waits for it.
class HandOverThread {
 public:
  /// Gives a connection to gRPC. Thread: this one.
  using HandOver = std::function<void(FileDescriptor connection)>;

  HandOverThread() = default;
  ~HandOverThread() { stop(); }
  HandOverThread(const HandOverThread&) = delete;
  HandOverThread& operator=(const HandOverThread&) = delete;

  /// Once.
  void start();
  /// `to` outlives stop(). `id`: of whoever calls. Thread: any.
  void hand_over(std::uint64_t id, const HandOver& to, FileDescriptor connection);
  /// Closes it if it waits still. Thread: any.
  void take_back(std::uint64_t id);
  /// Closes what waits, and resets what is being taken in. Idempotent.
  void stop();

 private:
  struct Waiting {
    std::uint64_t id;
    const HandOver* to;
    FileDescriptor connection;
  };
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  // Under mutex_:
  std::deque<Waiting> waiting_;
  FileDescriptor under_way_;  ///< a second descriptor of what is being taken in
  bool stopping_ = false;

  std::thread thread_;
};

}  // namespace axisd::transport
