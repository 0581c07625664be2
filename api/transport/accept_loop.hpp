// The daemon's own accept loop.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "api/transport/hand_over_thread.hpp"
#include "api/transport/listen.hpp"
#include "api/transport/memory_keeper.hpp"
#include "api/transport/peer_budgets.hpp"
#include "api/transport/stream_budget.hpp"
#include "api/transport/stream_counts.hpp"

namespace axisd::transport {

/// Accepts connections and hands them to gRPC. gRPC 1.51's own listener never accepts again after one EMFILE
/// (CVE-2023-4785); this one keeps a descriptor in reserve, turns the surplus connection away and goes on.
/// Each connection is watched through a second descriptor: how many an address has, and what it sends without
/// getting anything for it (PeerBudgets). gRPC is asked how many streams it has open there where they may be
/// too many (StreamBudget). gRPC 1.51 bounds none of that (CVE-2023-44487).
class AcceptLoop {
 public:
  using HandOver = HandOverThread::HandOver;
  struct Entry {
    ListeningSocket socket;
    HandOver hand_over;
  };
  /// How many calls of a connection, by gRPC's name of its other end, are in progress. Empty: nobody knows,
  /// and none are. Thread: the loop's.
  using InProgress = std::function<int(const std::string& peer)>;

  AcceptLoop() = default;
  ~AcceptLoop() { stop(); }
  AcceptLoop(const AcceptLoop&) = delete;
  AcceptLoop& operator=(const AcceptLoop&) = delete;

  /// Connections beyond these limits are closed at once.
  Result<void> start(std::vector<Entry> entries, const PeerBudgets::Limits& limits,
                     const StreamBudget::Limits& streams, InProgress in_progress);
  /// Closes the listening sockets. Idempotent.
  void stop();

  /// Connections turned away since the start. Thread: any.
  [[nodiscard]] std::uint64_t refused() const { return tally_.refused.load(std::memory_order_relaxed); }
  /// Of each of its addresses. Between start() and stop(). Thread: that of these.
  [[nodiscard]] std::vector<std::shared_ptr<Knock>> knocks() const;
  /// When the loop last came round, or was made. Thread: any.
  [[nodiscard]] TimePoint last_progress() const { return progress_.load(std::memory_order_relaxed); }
  /// When gRPC last took in one of those that it is given; now if it has them all. Thread: any.
  [[nodiscard]] TimePoint last_hand_over() {
    const auto now = monotonic_now();
    return std::min(tcp_.last_progress(now), local_.last_progress(now));
  }

 private:
  /// One that gRPC has, or is about to get.
  struct Connection {
    HandOverThread::Watched fd;  ///< of our own
    HandOverThread* way;         ///< to gRPC
    std::string address;         ///< as it is counted
    std::string peer;            ///< as gRPC names it; empty: it is not on TCP
    enum class Phase : std::uint8_t {
      open,
      listens,  ///< its peer sends no more: gRPC reads what has come, and ends the connection then
      left,     ///< it is over at both ends, and what it has said waits for gRPC
    };
    Phase phase = Phase::open;
    TimePoint since{};  ///< of the phase, but for the first
    void enter(Phase next, TimePoint now) { phase = next, since = now; }
  };
  using Phase = Connection::Phase;
  /// How often traffic is counted, and when it was last.
  struct Counting {
    Duration every{};
    TimePoint last{};
  };
  /// Since the start.
  struct Tally {
    std::uint64_t cut_off = 0, gave_way = 0;
    std::atomic<std::uint64_t> refused{0};
  };
  void run();
  /// False: nothing could be accepted, and trying again at once would spin.
  bool accept_one(const Entry& entry);
  bool turn_away(const Entry& entry);
  /// Ends a connection that gives way to one from `address`. False: there is none.
  bool make_room(const std::string& address, TimePoint now);
  void refuse(PeerBudgets::Entry why, const std::string& address);
  /// Cuts off who floods, by what the kernel has counted.
  void count_traffic(TimePoint now);
  /// Cuts off who keeps too many streams open. `traffic`: as it was counted just now.
  void count_streams(const std::map<PeerBudgets::Id, PeerBudgets::Traffic>& traffic, TimePoint now);
  /// Asks gRPC about these.
  void look_at_streams(const std::vector<PeerBudgets::Id>& ids, TimePoint now);
  /// Cuts off who keeps the thread that hands over, and what waits from there with it.
  void look_at_hand_over(HandOverThread& way, TimePoint now);
  /// Has what is free given back to the system, and cuts off who made it necessary.
  void look_at_memory(TimePoint now);
  void blame(PeerBudgets::Id id, std::string_view why, TimePoint now);
  void cut_off(PeerBudgets::Id id, std::string_view why);
  /// It is over at both ends. Counts what has come since it was counted last.
  void on_end(PeerBudgets::Id id);
  /// Closes those that gRPC has taken in meanwhile, and resets those that it does not get rid of.
  void look_at_leaving(TimePoint now);
  void close(PeerBudgets::Id connection);

  std::vector<Entry> entries_;
  HandOverThread tcp_, local_;  ///< local: unix sockets
  int first_refused_descriptor_ = 0;
  FileDescriptor wake_, reserve_;
  std::optional<PeerBudgets> budgets_;
  std::optional<StreamBudget> streams_;
  StreamCounts counts_;
  InProgress in_progress_;
  std::map<PeerBudgets::Id, Connection> connections_;
  PeerBudgets::Id last_id_ = 0;
  MemoryKeeper memory_;
  Counting counting_;
  Duration leaving_{};
  std::int64_t streams_of_one_ = 0;
  Tally tally_;
  std::atomic<TimePoint> progress_{monotonic_now()};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace axisd::transport
