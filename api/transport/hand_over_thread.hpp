// Connections on their way to gRPC.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "api/transport/peer_budgets.hpp"
#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::transport {

/// Gives gRPC its connections, in their order. gRPC 1.51 reads from a new connection on the thread that
/// brings it, and goes on for as long as there is something to read. So a connection is held back until it
/// has been brought, and gRPC's own threads read from it. Where the system cannot hold it back (a unix
/// socket, or more has come than it has room for) it keeps the thread, until the accept loop, which never
/// waits for it, ends that connection. A second thread would help nobody: gRPC's acceptor takes one at a
/// time, and whoever is inside keeps its mutex. So each acceptor has one.
class HandOverThread {
 public:
  using Id = std::uint64_t;
  /// Gives a connection to gRPC. Thread: this one.
  using HandOver = std::function<void(FileDescriptor connection)>;
  /// Of a connection, beside the one that is handed over.
  using Watched = std::shared_ptr<const FileDescriptor>;
  struct Kept {
    Id id;
    Watched watched;
  };
  /// Whoever keeps the thread for longer, and goes on sending, is to be ended.
  static constexpr Duration patience = std::chrono::milliseconds(500);
  /// Bytes that come meanwhile which are nobody's fault: pings, and the like.
  static constexpr std::uint64_t little = PeerBudgets::quiet;

  HandOverThread() = default;
  ~HandOverThread() { stop(); }
  HandOverThread(const HandOverThread&) = delete;
  HandOverThread& operator=(const HandOverThread&) = delete;

  /// Once.
  void start();
  /// `to` outlives stop(). `id`: of whoever calls. Thread: any.
  void hand_over(Id id, const HandOver& to, FileDescriptor connection, Watched watched);
  /// Closes it if it waits still; false: it does not. Thread: any.
  bool take_back(Id id);
  /// It has not been brought yet. Thread: any.
  [[nodiscard]] bool has_waiting(Id id);
  /// Closes what waits, and resets what is being taken in. Idempotent.
  void stop();
  /// Who has kept the thread for longer than `patience` and has sent more than `little` since that was found,
  /// whether others wait or not. Without that it is not its bytes that keep the thread: the process stood
  /// still, or gRPC waits for something else. Thread: any.
  [[nodiscard]] std::optional<Kept> kept_by(TimePoint now);
  /// Since when it has been owed that the thread comes round, because somebody waits for it or is inside;
  /// `now`: it is not. Who is taken back still waits by that. Thread: any.
  [[nodiscard]] TimePoint last_progress(TimePoint now);

 private:
  struct Waiting {
    Id id;
    const HandOver* to;
    FileDescriptor connection;
    Watched watched;
  };
  struct Inside {
    Id id;
    Watched watched;
    TimePoint since;
    std::optional<std::uint64_t> bytes{};  ///< once it was found to keep the thread
  };
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  // Under mutex_:
  std::deque<Waiting> waiting_;
  std::optional<Inside> inside_;
  std::optional<TimePoint> owed_since_;  ///< only the thread ends it
  bool stopping_ = false;

  std::thread thread_;
};

}  // namespace axisd::transport
