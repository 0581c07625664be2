// A simulated RS-485 line behind a pseudo terminal, in real time: whatever opens path() finds the drives
// there.
#pragma once

#include <atomic>
#include <deque>
#include <mutex>
#include <span>
#include <string>
#include <thread>

#include "buses/error.hpp"
#include "devices/simulation/rtu_network.hpp"

namespace axisd::simulation {

struct PtyLineSettings {
  /// What the drives join; the terminal begins with it and follows its client from then on.
  Serial serial{};
  Duration turnaround = RtuNetworkSettings{}.turnaround;
  std::string
      link{};  ///< symbolic link to the terminal; empty: none. Replaced if it is a link, else an error
  FrameObserver observer{};  ///< called while the line is held: must not call back
};

/// Owns a pty and a thread. Bytes take their wire time both ways: a request counts from when it was read, and
/// the reply's bytes are handed over when they would have arrived (the first at its time, the others in lots
/// of 1 ms). Thread: any, except where it says otherwise.
class PtyLine {
 public:
  /// Errors: no pty can be had, the link cannot be made.
  static Result<std::unique_ptr<PtyLine>> open(PtyLineSettings settings,
                                               std::vector<std::unique_ptr<SimulatedRtuNode>> nodes);
  ~PtyLine();
  PtyLine(const PtyLine&) = delete;
  PtyLine& operator=(const PtyLine&) = delete;

  /// What a client opens: the link, or else the terminal itself (which changes with replug()).
  [[nodiscard]] std::string path() const;

  /// Runs `use` with the network, advanced to now, while the line's thread stands aside: for power, inputs,
  /// alarms, faults, reading the shaft. Must not block.
  template <class Use>
  auto with_network(Use use) {
    const Held held(*this);
    return use(network_);
  }

  /// Pulls the adapter out: the client sees its terminal hang up and the link disappears; replug() puts it
  /// back.
  void hang_up();
  Result<void> replug();
  [[nodiscard]] bool plugged() const;

 private:
  /// A lot of bytes that is handed to the client at `when`.
  struct Lot {
    TimePoint when;
    std::vector<std::uint8_t> bytes;
  };
  /// Holds the mutex, lets the network catch up before, and wakes the thread after.
  class Held {
   public:
    explicit Held(PtyLine& line);
    ~Held();

   private:
    PtyLine& line_;
    std::unique_lock<std::mutex> lock_;
  };

  explicit PtyLine(PtyLineSettings settings);
  Result<void> plug();
  void unplug();
  void run();
  void read_master(TimePoint now);
  void receive(std::span<const std::uint8_t> bytes, TimePoint now);
  void queue_replies();
  void write_due(TimePoint now);
  void wait(TimePoint until, bool orphaned, int master);
  void wake();

  PtyLineSettings settings_;
  mutable std::mutex mutex_;  ///< guards all below but `wake_fd_` and `stopping_`
  RtuNetwork network_;
  int master_ = -1;
  bool orphaned_ = false;  ///< no client has the terminal open
  std::string terminal_;
  std::deque<Lot> lots_;
  int wake_fd_ = -1;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace axisd::simulation
