// The daemon's own accept loop.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "api/transport/listen.hpp"
#include "api/transport/peer_budgets.hpp"

namespace axisd::transport {

/// Accepts connections and hands them to gRPC. gRPC 1.51's own listener never accepts again after one EMFILE
/// (CVE-2023-4785); this one keeps a descriptor in reserve, turns the surplus connection away and goes on.
/// Each connection is watched through a second descriptor: how many an address has, and what it sends without
/// getting anything for it (PeerBudgets). gRPC 1.51 bounds none of that (CVE-2023-44487).
class AcceptLoop {
 public:
  /// Gives a connection to gRPC. Thread: the loop's.
  using HandOver = std::function<void(FileDescriptor connection)>;
  struct Entry {
    ListeningSocket socket;
    HandOver hand_over;
  };

  AcceptLoop() = default;
  ~AcceptLoop() { stop(); }
  AcceptLoop(const AcceptLoop&) = delete;
  AcceptLoop& operator=(const AcceptLoop&) = delete;

  /// Connections beyond these limits are closed at once.
  Result<void> start(std::vector<Entry> entries, const PeerBudgets::Limits& limits);
  /// Closes the listening sockets. Idempotent.
  void stop();

  /// Connections turned away since the start. Thread: any.
  [[nodiscard]] std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }
  /// Of each of its addresses. Between start() and stop(). Thread: that of these.
  [[nodiscard]] std::vector<std::shared_ptr<Knock>> knocks() const;
  /// When the loop last came round, or was made. Thread: any.
  [[nodiscard]] TimePoint last_progress() const { return progress_.load(std::memory_order_relaxed); }

 private:
  void run();
  /// False: nothing could be accepted, and trying again at once would spin.
  bool accept_one(const Entry& entry);
  bool turn_away(const Entry& entry);
  /// Ends a connection that gives way to one from `address`. False: there is none.
  bool make_room(const std::string& address, TimePoint now);
  void refuse(PeerBudgets::Entry why, const std::string& address);
  /// Cuts off who floods, by what the kernel has counted.
  void count_traffic(TimePoint now);
  /// Gives back to the system what is free, and cuts off who made it necessary.
  void look_at_memory(TimePoint now);
  void cut_off(PeerBudgets::Id id);
  void close(PeerBudgets::Id connection);

  std::vector<Entry> entries_;
  int first_refused_descriptor_ = 0;
  FileDescriptor wake_, reserve_;
  std::optional<PeerBudgets> budgets_;
  std::map<PeerBudgets::Id, FileDescriptor> connections_;  ///< of each that gRPC has, one of our own
  PeerBudgets::Id last_id_ = 0;
  TimePoint counted_{}, looked_{}, trimmed_{};
  std::size_t memory_limit_ = 0, resident_when_trimmed_ = 0;  ///< bytes
  std::uint64_t cut_off_ = 0, cut_off_when_trimmed_ = 0, gave_way_ = 0;
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<TimePoint> progress_{monotonic_now()};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace axisd::transport
