// Connections on their way to gRPC.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::transport {

/// Give gRPC its connections, in their order. gRPC 1.51 reads from a new connection on the thread that brings
/// it, and goes on for as long as there is something to read. So a connection is held back until it has been
/// brought, and gRPC's own threads read from it. Where the system cannot hold it back (a unix socket, or more
/// has come than it has room for) it keeps its thread; there are others, and the accept loop, which never
/// waits for any of them, ends connections that keep all of them.
class HandOverThreads {
 public:
  using Id = std::uint64_t;
  /// Gives a connection to gRPC. Thread: any of these.
  using HandOver = std::function<void(FileDescriptor connection)>;
  /// Of a connection, beside the one that is handed over.
  using Watched = std::shared_ptr<const FileDescriptor>;
  static constexpr std::size_t number = 4;
  /// Where all threads are kept for longer, and others wait, those who keep them are to be ended.
  static constexpr Duration patience = std::chrono::milliseconds(500);

  HandOverThreads() = default;
  ~HandOverThreads() { stop(); }
  HandOverThreads(const HandOverThreads&) = delete;
  HandOverThreads& operator=(const HandOverThreads&) = delete;

  /// Once.
  void start();
  /// `to` outlives stop(). `id`: of whoever calls. Thread: any.
  void hand_over(Id id, const HandOver& to, FileDescriptor connection, Watched watched);
  /// Closes it if it waits still; false: it does not. Thread: any.
  bool take_back(Id id);
  /// Closes what waits, and resets what is being taken in. Idempotent.
  void stop();
  /// Who keeps others waiting, as stated at `patience`. Thread: any.
  [[nodiscard]] std::vector<Id> keeping_others(TimePoint now);
  /// When one was last taken up; `now` if none waits. Thread: any.
  [[nodiscard]] TimePoint last_progress(TimePoint now);

 private:
  struct Waiting {
    Id id;
    const HandOver* to;
    FileDescriptor connection;
    Watched watched;
    TimePoint since;
  };
  struct UnderWay {
    Id id;
    Watched watched;
    TimePoint since;
  };
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  // Under mutex_:
  std::deque<Waiting> waiting_;
  std::list<UnderWay> under_way_;
  TimePoint taken_up_{};
  bool stopping_ = false;

  std::array<std::thread, number> threads_;
};

}  // namespace axisd::transport
